/* SPDX-License-Identifier: BSD-3-Clause */
/* Internals of a run, for its files: its start, its changes of formulation, its failures, its work. */
#pragma once

#include "backend/time_scales.h"
#include "constraints/evaluation/evaluator.h"
#include "constraints/partition/partition.h"
#include "constraints/partition/rank_margin.h"
#include "integrators/decide/endless_growth.h"
#include "integrators/formulations/formulation.h"
#include "integrators/run/events.h"
#include "integrators/run/friction_run.h"
#include "integrators/run/impact.h"
#include "integrators/run/run.h"
#include "integrators/run/work_bound.h"
#include "integrators/steppers/sample_times.h"
#include "integrators/steppers/solver.h"
#include <kempe/check.h>

/* The integrator of a run whose user chose none (runner_integrator.c). */
typedef enum kmp_trial { KMP_TRIAL_LATER, KMP_TRIAL_BEFORE, KMP_TRIAL_BEGINS, KMP_TRIAL_RUNS } kmp_trial;

typedef struct kmp_integrator_choice {
    bool open;                   /* it may be changed */
    const kmp_solver_kind *kind; /* in use; NULL: not yet chosen */
    double ratio;                /* counted time of radau over that of dop853, expected at the start; 0: not counted */
    kmp_solver *other;           /* made before, now resting; NULL: none */
    const kmp_solver_kind *other_kind;
    kmp_trial trial;
    long next;        /* steps of the present solver until the next part of a trial */
    long patience;    /* steps until the next trial */
    double t, cycles; /* at the beginning of a measurement */
    double pace, h;   /* of the other integrator before the trial: time simulated in a counted cycle; its step */
} kmp_integrator_choice;

/* Sampled states (sampler.c). */
typedef struct kmp_sampler kmp_sampler;

struct kmp_runner {
    const kempe_system *s;
    kmp_run_spec spec;
    kmp_integrator_choice choice;
    kmp_stand_in stand_in;
    long restarted; /* attempted steps at the last restart for inputs */
    kmp_team *team; /* thread pool of the evaluator and all users of its back end; NULL: none */
    kmp_evaluator *eval;
    kmp_arena arena;                 /* of all arrays except those of a formulation */
    bool may_take_bodies, by_bodies; /* the system has articulated bodies for it; formulations that can use them do */
    kmp_partition part;
    kmp_rank_margin margin;
    kmp_formulation *formulation;
    const kmp_formulation_kind *method; /* the chosen formulation, also near change points */
    bool near_singular;
    bool walks; /* crosses a change point in dop853 steps, after the integrator and all steps across failed */
    double near_singular_t; /* time of entry into the surroundings of a change point */
    bool brief;             /* the formulation before lasted for a few steps */
    const kmp_solver_kind *kind;
    kmp_solver *solver;
    kmp_run_report before;        /* work of earlier formulations and solvers */
    double *state, *qdd, *lambda; /* q, qd, qdd, lambda at the start or a change; the last two of these */
    double *seen, seen_t;         /* the user's coordinates (n) of spherical joints, and their time */
    double *next_seen;            /* n */
    long centrings;
    kmp_event_tracker *crossing; /* NULL without conditions */
    kmp_friction_run *friction;  /* NULL without friction that sticks */
    bool loaded_friction;        /* some level depends on multipliers */
    kmp_impacts *impacts;        /* NULL without rigid contacts */
    bool at_event;
    double event_t;       /* the end of the last step if at_event */
    double stop;          /* no step goes beyond this or a sample of an input; spec.t_end unless the caller sets it
                             (kmp_runner_cut) */
    bool anew;            /* the next step restarts the integrator: external inputs of the equations may have changed */
    kmp_sampler *sampler; /* NULL without sampled states */
    struct kmp_delays *delays; /* NULL without delayed signals */
    double pace;               /* the proposed step, if steps that end at `stop` are shorter; 0: they are not */
    double *y, *yp;            /* at a row; yp for a DAE only */
    double *rows;              /* entries of J, h_t: as they were before a bend */
    double *moved;             /* 3 n + m: a row, if moving closures do work */
    double work;               /* of non-conservative forces on a dae formulation, by quadrature up to work_t */
    double work_t;
    double rate_scale, build_s;
    unsigned long memory_failures; /* at the creation of the run */
    kmp_run_log own, *log;         /* the caller's log, or the run's own */
    long rescued_at;               /* number of attempted steps at the last restart of a stopped integrator */
    char *reason;
    bool locks;
    bool cut; /* given up for spec.limit_s */
    kmp_work_bound bound;
    kmp_growth growth;
    kmp_time_scales scales; /* of the functions of time, unless no step may be longer than spec.max_step */
    bool ended, requested;  /* by a condition; by one of the model's `until` */
};

/* runner_start.c */

/** Makes everything that a run needs before its integrator starts. */
kempe_status kmp_runner_prepare(kmp_runner *run, const kempe_assembly *start);

/** Makes the room of a run's state, and what states that take next values, friction and contacts need. */
kempe_status kmp_runner_make_parts(kmp_runner *run);

/** Begins at spec.t_start: inputs, sampled states, conditions, rows, impacts and modes. The state is in run->state, the
 * rows in run->part. */
kempe_status kmp_runner_begin_at(kmp_runner *run, const kempe_assembly *start);

/** Chooses rows and coordinates at (t, q); rank < 0: by the pivots. */
kempe_status kmp_runner_choose(kmp_runner *run, double t, const double *q, int rank, const int *wish, int wish_count);

/** Makes the margin of the chosen rows at (t, q), the distance from a change point, unless change points are ignored.
 */
kempe_status kmp_runner_compute_margin(kmp_runner *run, double t, const double *q);

/** True for rounded numbers if q is not closed on the rows kept now; kmp_runner_project closes q and qd on them. */
bool kmp_runner_is_off(kmp_runner *run, double t, const double *q);
kempe_status kmp_runner_project(kmp_runner *run, double t, double *q, double *qd);

/** Computes qdd and lambda of the chosen rows at the evaluator's last closure, which was at (t, q). */
kempe_status kmp_runner_accelerate(kmp_runner *run, double t, const double *q, const double *qd);

/** The start of a formulation at a state, with the rows and the margin of the run. */
kmp_formulation_start kmp_runner_given(kmp_runner *run, double t, const double *q, const double *qd, double work);

/** Makes the formulation at a state, that across change points if the run is near one, and its integrator. */
kempe_status kmp_runner_make(kmp_runner *run, double t, const double *q, const double *qd, double work);

/** Starts the integrator at (t, y[, yp]), a one-step method with a step h (0: of its own choice). */
kempe_status kmp_runner_start(kmp_runner *run, double t, const double *y, const double *yp, double h);

/* runner_site.c: a run that makes no steps. It stands at states of other motions of its system in turn. */

/** Makes one with the evaluator of the caller, which has the numbers and conditions of the present motion. */
kempe_status kmp_runner_site_new(kmp_evaluator *eval, const kmp_run_spec *spec, kmp_runner **site);
void kmp_runner_site_free(kmp_runner *site);

/** Takes the memory of any run of the system; `elsewhere`: for another state, at which modes and impacts begin as at a
 * start. */
void kmp_runner_take_memory(kmp_runner *run, const void *memory, bool elsewhere);

/* runner_inputs.c */

/** Goes on beyond a sample of an input where the last step has ended at it: restarts the integrator where the value
 * jumps. */
kempe_status kmp_runner_pass_samples(kmp_runner *run, double t);

/** Takes the inputs from t on, after the row at t within the last step has been made. */
kempe_status kmp_runner_take_inputs(kmp_runner *run, double t);

/** Changes the conditions that the inputs from t on have changed, at the state in run->state; ends the run where one of
 * them says so. */
kempe_status kmp_runner_take_conditions(kmp_runner *run, double t);

/** Makes the sampler of a run that starts at t, if the model has sampled states. */
kempe_status kmp_runner_make_sampler(kmp_runner *run, double t);
void kmp_runner_free_sampler(kmp_runner *run);

/** Lists what the sampler knows of its past; returns the number of pieces. Their size in all. */
int kmp_runner_sampler_memory(kmp_runner *run, kmp_memory_piece *piece);
size_t kmp_sampler_memory_size(const kempe_model *model);

/** The end of the integrator's steps: the caller's, or the next sample of an input or a state. Times that are equal up
 * to rounding are one. */
double kmp_runner_pause(const kmp_runner *run);

/** The end of the step that begins at t: that of the integrator's steps, or t and the longest step that is allowed. */
double kmp_runner_limit(const kmp_runner *run, double t);

/** The last time whose row belongs to a step that ends at t: beyond t by rounding where a sample of a state or an input
 * is due, so that the row has the values before it. */
double kmp_runner_reach(const kmp_runner *run, double t);

/** The time of the next sample that has not been taken; INFINITY: there is none. */
double kmp_runner_next_sample(const kmp_runner *run);

/** True if a sample is due at t. */
bool kmp_runner_sample_is_due(const kmp_runner *run, double t);

/** Notes which comparisons of states that change at events are true. Returns true if one has become true since the
 * last call, and its state is due. */
void kmp_runner_note_events(kmp_runner *run);
bool kmp_runner_meets_events(kmp_runner *run);

/** At the start: true if the comparison of a state holds that changes then too, and the state is due. */
bool kmp_runner_settles(kmp_runner *run);

/** Takes the samples that are due at t: sets sampled states in run->state, whose inputs are those from t on. */
void kmp_runner_take_samples(kmp_runner *run, double t);

/* runner_integrator.c */

/** Makes the integrator for the present formulation and state; the first one is chosen by counted work. */
kempe_status kmp_runner_make_integrator(kmp_runner *run);

/** True for a mechanism with no degree of freedom: it is followed along its closures, there are no unknowns of
 * motion. */
bool kmp_runner_is_followed(const kmp_runner *run);

/** The integrator for which a formulation is made. */
const kmp_solver_kind *kmp_runner_integrator(const kmp_runner *run);

/** Between steps, at t: tries another integrator where the user chose none. */
kempe_status kmp_runner_try_integrator(kmp_runner *run, double t);

/** Frees the integrators of the present formulation. */
void kmp_runner_release_integrators(kmp_runner *run);

/* runner_stand_in.c */

/** At a restart for inputs: true if another integrator shall continue, for which the formulation is made anew. */
bool kmp_runner_relieve(kmp_runner *run, double t);

/** Between steps, at t: returns to the multistep method after enough steps without a restart. */
kempe_status kmp_runner_return(kmp_runner *run, double t);

/* runner_change.c */

/** Continues at t with a new formulation for the present integrator, from the state that the old one completes, with
 * `first_step`. */
kempe_status kmp_runner_change_formulation(kmp_runner *run, double t, bool near_singular, double first_step);

/** Handles the end of the last step at t: passes an event, changes the formulation or the unknowns. */
kempe_status kmp_runner_change(kmp_runner *run, double t);

/** Takes the inputs from t within the last step on, and restarts the integrator there, a one-step method with its
 * present step size. */
kempe_status kmp_runner_begin_anew(kmp_runner *run, double t);

/** Recovers from a step that failed: an implicit integrator restarts from a consistent state. The reduced formulation,
 * if the user did not choose it, is replaced by the projected one. */
kempe_status kmp_runner_rescue(kmp_runner *run, double t);

/** Ends the run at t with the sentence of a condition: KEMPE_STOPPED. */
kempe_status kmp_runner_end(kmp_runner *run, double t, int condition);

/** Passes what happens at t, at the closed state in run->state: the `event` that the crossing has looked at, samples,
 * states that change at events, jumps of inputs, and the impacts and modes that follow. *work: of impacts, J. */
kempe_status kmp_runner_pass_here(kmp_runner *run, double t, bool event, double *work);

/** Continues with another formulation from a state in the present charts (q, qd, qdd in run->state) with a first
 * step. */
kempe_status kmp_runner_restart(kmp_runner *run, double t, bool near_singular, double work, double first_step);

/* runner_center.c */

/** q at t within the last step, to the accuracy of the integration; kmp_runner_place: in run->state, with the closures
 * of the evaluator evaluated there. */
kempe_status kmp_runner_position(kmp_runner *run, double t, double *q);
kempe_status kmp_runner_place(kmp_runner *run, double t);

/** Sets q and qd of the start in run->state; spherical joints with nearly singular angles are centred. */
void kmp_runner_center_start(kmp_runner *run, const kempe_assembly *start);

/** Centres the spherical joints whose angles approached their singular position in the step that ended at t. */
kempe_status kmp_runner_center(kmp_runner *run, double t);

/** Follows the user's coordinates of centred joints up to t within the last step, not back. */
void kmp_runner_follow(kmp_runner *run, double t);

/** Converts a row to the user's coordinates, at the time to which these were followed. */
void kmp_runner_show(kmp_runner *run, double *q, double *qd, double *qdd);

/** kmp_runner_row in the coordinates of the present charts; `whole`: with accelerations and multipliers. */
kempe_status kmp_runner_inner_row(kmp_runner *run, double t, bool whole, double *row, double *work);

/* runner_bridge.c */

/** Computes the row at t within the last step by another formulation after its own has failed, and notes it in the
 * log; arguments as for kmp_runner_inner_row. false: not available, and nothing is changed. */
bool kmp_runner_bridge(kmp_runner *run, double t, double *row, double *work);

/* runner_explain.c */

/** Turns KEMPE_E_FAILED into run->reason, `otherwise` without a known reason; KEMPE_STOPPED when the mechanism locks.
 * Other statuses pass. */
kempe_status kmp_runner_give_up(kmp_runner *run, kempe_status status, const char *otherwise, double t);

/** Appends the sentence of a condition that ends runs. */
void kmp_runner_put_end(const kmp_runner *run, int condition, double t, kmp_text *text);

/** Fails without multipliers at a state: reports the condition that ends runs there, if there is one, or the force. */
kempe_status kmp_runner_fail_unsettled(kmp_runner *run, double t, const double *q, const double *qd);

/** Appends the sentence of a lock, the formulation, the integrator, or `otherwise`. True for a lock. */
bool kmp_runner_reason(kmp_runner *run, const char *otherwise, double t, kmp_text *text);

/** Appends to a reason the spherical joint with nearly singular angles at the last step, if there is one. */
void kmp_runner_explain_angles(kmp_runner *run, kmp_text *text);

/** The row of a prescribed motion that cannot continue beyond the last step's end, a dead centre; -1: none. */
int kmp_runner_lock(kmp_runner *run, double t);

/** The coordinate that a row alone prescribes, NULL for several. */
const char *kmp_runner_driven_by(const kempe_system *s, int row);

/* run.c */

/** Adds the work of the present formulation and integrator. */
void kmp_runner_add_report(const kmp_runner *run, kmp_run_report *report);

/** Number of attempted steps, rejected and refused ones included. */
long kmp_runner_tried(const kmp_runner *run);
