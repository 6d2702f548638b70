/* SPDX-License-Identifier: BSD-3-Clause */
/* The inside of a run, for the files that make one: its start, its changes of formulation, its failures, the work on
 * it. */
#ifndef KMP_INTEGRATORS_RUN_RUNNER_H
#define KMP_INTEGRATORS_RUN_RUNNER_H

#include "constraints/evaluation/plant.h"
#include "constraints/partition/margin.h"
#include "constraints/partition/partition.h"
#include "integrators/formulations/formulation.h"
#include "integrators/run/events.h"
#include "integrators/run/run.h"
#include "integrators/run/work_bound.h"
#include "integrators/steppers/solver.h"

struct kmp_runner {
    const kempe_system *s;
    kmp_run_spec spec;
    kmp_team *team; /* of the plant and all that takes its back end; NULL: none */
    kmp_plant *plant;
    kmp_arena arena; /* of arrays, but for those of a formulation */
    bool by_bodies;  /* formulations that can go by articulated bodies do */
    kmp_partition part;
    bool has_part;
    kmp_margin margin;
    kmp_formulation *formulation;
    const kmp_formulation_kind *way; /* the formulation asked for; `formulation` may be the zone instead */
    bool in_zone;
    bool walks;    /* across the zone in steps of dop853: no leap leads across, and the integrator stopped */
    double zone_t; /* where the zone was entered */
    bool brief;    /* the formulation before lasted for a few steps */
    const kmp_solver_kind *kind;
    kmp_solver *solver;
    kmp_run_report before; /* work of formulations and solvers that are gone */
    double *state;         /* q, qd, qdd, lambda at a change of formulation */
    double *seen, seen_t;  /* the user's coordinates (n) of spherical joints, at a time */
    double *next_seen;     /* n */
    long centrings;
    kmp_crossing *crossing; /* NULL when the model has no conditions */
    bool at_event;
    double event_t;       /* where the last step ends when at_event */
    double stop;          /* no step goes beyond; spec.t_end unless the caller says (kmp_runner_cut) */
    bool anew;            /* the next step begins the integrator anew: what equations read from outside may differ */
    double pace;          /* the step that was proposed where steps that end at `stop` are shorter; 0: they are not */
    double *y, *yp;       /* at a row; yp for a DAE only */
    double *qdd, *lambda; /* at the start */
    double *moved;        /* 3 n + m: a row, where closures that move do work */
    double work;          /* of non-conservative forces on a dae formulation, by quadrature up to work_t */
    double work_t;
    double rate_scale, build_s, progress;
    unsigned long memory_failures; /* before it was made */
    kmp_journal own, *journal;     /* the one asked for, or its own */
    long rescued_at;               /* steps tried when an integrator was last started anew after it had stopped */
    char *reason;
    bool locks;
    bool cut; /* given up for spec.limit_s */
    kmp_work_bound bound;
    bool ended; /* a condition has */
};

/* runner_start.c */

/** All that a run needs before its integrator starts. */
kempe_status kmp_runner_prepare(kmp_runner *run, const kempe_assembly *start);

/** Rows and coordinates at (t, q); rank < 0: as the pivots say. */
kempe_status kmp_runner_choose(kmp_runner *run, double t, const double *q, int rank, const int *wish, int wish_count);

/** Brings q and qd onto the rows that are now independent. */
bool kmp_runner_is_off(kmp_runner *run, double t, const double *q);
kempe_status kmp_runner_project(kmp_runner *run, double t, double *q, double *qd);

/** qdd and lambda of the chosen rows at the plant's last closure, which was at (t, q). */
kempe_status kmp_runner_accelerate(kmp_runner *run, double t, const double *q, const double *qd);

/** The formulation that leads this one through change points. */
const kmp_formulation_kind *kmp_runner_zone(const kmp_runner *run);
kempe_status kmp_runner_make_formulation(kmp_runner *run, const kmp_formulation_kind *way, double t, const double *q,
                                         const double *qd, double work);
kempe_status kmp_runner_make_solver(kmp_runner *run);

/** Starts the integrator at (t, y[, yp]), a one-step method with a step h (0: of its own choice). */
kempe_status kmp_runner_start(kmp_runner *run, double t, const double *y, const double *yp, double h);

/* runner_change.c */

/** What the last step, which ended at t, calls for: an event passed, another formulation, other unknowns. */
kempe_status kmp_runner_change(kmp_runner *run, double t);

/** Begins the integrator anew at t within the last step, a one-step method with the step it had. */
kempe_status kmp_runner_begin_anew(kmp_runner *run, double t);

/** Takes the step that could not be made: an implicit integrator from a state made consistent; the reduced formulation,
 * when nobody asked for it, gives way to the projected one. */
kempe_status kmp_runner_rescue(kmp_runner *run, double t);

/** Goes on at t with another formulation, from the state that the old one completes. */
kempe_status kmp_runner_change_formulation(kmp_runner *run, double t, bool to_zone);

/** The same from a state of the charts at hand (q, qd, qdd in run->state); first_step: as for an integrator's start. */
kempe_status kmp_runner_take_up(kmp_runner *run, double t, bool to_zone, double work, double first_step);

/* runner_center.c */

/** q and qd of the start in run->state, spherical joints centred where their angles are nearly singular. */
void kmp_runner_center_start(kmp_runner *run, const kempe_assembly *start);

/** Centres the spherical joints whose angles came near to their singular position in the step that ended at t. */
kempe_status kmp_runner_center(kmp_runner *run, double t);

/** Follows the user's coordinates of centred joints up to t within the last step, not back. */
void kmp_runner_follow(kmp_runner *run, double t);

/** A row at the time that they were followed to, in the user's coordinates. */
void kmp_runner_show(kmp_runner *run, double *q, double *qd, double *qdd);

/** Row at a time within the last step, in the coordinates of the charts at hand. */
kempe_status kmp_runner_inner_row(kmp_runner *run, double t, double *q, double *qd, double *qdd, double *lambda,
                                  double *work);

/* runner_bridge.c */

/** The row at t within the last step by another way than the formulation's own, which has failed, and said in the
 * journal; arguments as of kmp_runner_inner_row. false: not to be had so either, and nothing is changed. */
bool kmp_runner_bridge(kmp_runner *run, double t, double *q, double *qd, double *qdd, double *lambda, double *work);

/* runner_explain.c */

/** Turns KEMPE_E_FAILED into run->reason, `otherwise` when nobody knows one; KEMPE_STOPPED when the mechanism locks.
 * Other statuses pass. */
kempe_status kmp_runner_give_up(kmp_runner *run, kempe_status status, const char *otherwise, double t);

/** No multipliers are found there: what ends runs there says so, if anything does, or the force is named. */
kempe_status kmp_runner_fail_unsettled(kmp_runner *run, double t, const double *q, const double *qd);

/** The sentence of a failure: a lock's, the formulation's, the integrator's, or `otherwise`. Whether it is a lock. */
bool kmp_runner_reason(kmp_runner *run, const char *otherwise, double t, kmp_text *text);

/** Adds to a reason which spherical joint has angles near to their singular position at the last step, if one has. */
void kmp_runner_explain_angles(const kmp_runner *run, kmp_text *text);

/** The row of a prescribed motion that cannot go on beyond the last step's end, which is a dead centre; -1: none. */
int kmp_runner_lock(kmp_runner *run, double t);

/** The coordinate that a row alone prescribes, NULL when it has several. */
const char *kmp_runner_driven_by(const kempe_system *s, int row);

/* runner_work.c */

/** Of non-conservative forces on a dae formulation, up to t within the last step. */
kempe_status kmp_runner_add_work(kmp_runner *run, double t);

/* run.c */

/** Adds the work of the formulation and integrator at hand. */
void kmp_runner_add_report(const kmp_runner *run, kmp_run_report *report);

/** Steps so far, those rejected and refused among them. */
long kmp_runner_tried(const kmp_runner *run);

#endif
