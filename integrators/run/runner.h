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
#include "integrators/steppers/sample_times.h"
#include "integrators/steppers/solver.h"
#include <kempe/check.h>

/* The integrator of a run whose user chose none (runner_integrator.c). */
typedef enum kmp_trial { KMP_TRIAL_LATER, KMP_TRIAL_BEFORE, KMP_TRIAL_BEGINS, KMP_TRIAL_RUNS } kmp_trial;

typedef struct kmp_integrator_choice {
    bool open;                        /* it may be changed */
    const kmp_formulation_kind *left; /* the formulation before, since the projected one continues in place of an
                                       * exchange of coordinates; NULL: the one of the run */
    double left_t;                    /* since then */
    bool waits;    /* the last unknowns did not last long enough for lanes: they are made once they pay */
    double from;   /* cycles of both integrators when the present unknowns were taken */
    double from_t; /* then; if the run has left and taken them again, the present time less the time with them */
    double since, since_t;        /* the same only of the present visit */
    long since_steps;             /* steps of both integrators at its beginning */
    double price, price_in_lanes; /* cycles of dop853, of radau, in which lanes save what it takes to make them */
    const kmp_solver_kind *kind;  /* in use; NULL: not yet chosen */
    double ratio;      /* counted time of radau over the time of dop853, expected at the start; 0: not counted */
    kmp_solver *other; /* made before, now resting; NULL: none */
    const kmp_solver_kind *other_kind;
    kmp_trial trial;
    long next;        /* steps of the present solver until the next part of a trial */
    long patience;    /* steps until the next trial */
    double t, cycles; /* at the beginning of a measurement */
    double pace, h;   /* of the other integrator before the trial: time simulated in a counted cycle; its step */
} kmp_integrator_choice;

/* A formulation that the run has left and may return to (runner_visits.c). */
typedef struct kmp_visit {
    kmp_formulation *formulation; /* NULL: none */
    const kmp_formulation_kind *method;
    double *y, *yp; /* in its arena */
    const kmp_solver_kind *kind;
    kmp_solver *solver;
    kmp_integrator_choice choice; /* when it was left */
    double t;                     /* then */
} kmp_visit;

/* Formulations that rest at a time. */
enum { KMP_MOST_VISITS = 8 };

/* Sampled states (sampler.c). */
typedef struct kmp_sampler kmp_sampler;

/* The surroundings of a change point. */
typedef struct kmp_passage {
    bool near;
    bool walks;   /* it is crossed in dop853 steps, after the integrator and all steps across failed */
    double since; /* time of entry */
} kmp_passage;

/* Formulations that rest: KMP_MOST_VISITS, of which the last one that was left comes last; NULL: none was left. */
typedef struct kmp_resting {
    kmp_visit *visit;
    int count;
} kmp_resting;

/* The user's coordinates (n) of spherical joints, and their time. */
typedef struct kmp_turned {
    double *now, t;
    double *next, *before; /* work: the next ones; coordinates of the charts at t */
} kmp_turned;

/* Elements with rows that are held or not (friction_run.c, impact.c). */
typedef struct kmp_sticking {
    kmp_friction_run *friction; /* NULL without friction that sticks */
    struct kmp_held_rows *held; /* their rows */
    bool loaded;                /* some level depends on multipliers */
    kmp_impacts *impacts;       /* NULL without rigid contacts */
} kmp_sticking;

typedef struct kmp_runner_events {
    kmp_event_tracker *tracker; /* NULL without conditions */
    kmp_passed_event passed;    /* noted for derivatives of the motion (spec.slopes) */
    bool *caused;               /* its conditions; NULL: not noted */
    bool here;                  /* the last step has ended at an event, */
    double t;                   /* at this time */
    bool watch_loads;           /* a condition that ends the run depends on accelerations or multipliers */
    bool ended;                 /* a condition has ended the run, */
    bool requested;             /* which is one of the model's `until` */
} kmp_runner_events;

/* These bound the next steps. */
typedef struct kmp_stops {
    double at;   /* no step goes beyond this or a sample of an input; spec.t_end unless the caller sets it
                    (kmp_runner_cut) */
    bool anew;   /* the integrator restarts before the next step, since inputs of the equations may have changed */
    double pace; /* the proposed step, if steps that end at `at` are shorter; 0: they are not */
} kmp_stops;

typedef struct kmp_runner_room {
    double *state, *qdd, *lambda; /* q, qd, qdd, lambda at the start or a change; the last two of these */
    double *y, *yp;               /* at a row; yp for a DAE only */
    double *rows;                 /* entries of J, h_t: as they were before a bend */
    kmp_kept_loads before_rows, before_dense;
} kmp_runner_room;

/* The work of non-conservative forces on a dae formulation, by quadrature up to t. */
typedef struct kmp_work_balance {
    double work, t;
    double *row; /* 3 n + m, if moving closures do work */
} kmp_work_balance;

/* Bounds on the work of a run; `ahead`: up to the time `until`, which is 0 where there is none. */
typedef struct kmp_runner_bounds {
    kmp_work_bound now, ahead;
    double until;
} kmp_runner_bounds;

struct kmp_runner {
    const kempe_system *s;
    kmp_run_spec spec;
    kmp_integrator_choice choice;
    kmp_stand_in stand_in;
    kmp_team *team; /* thread pool of the evaluator and all users of its back end; NULL: none */
    kmp_evaluator *eval;
    kmp_arena arena;                 /* of all arrays except the arrays of a formulation */
    bool may_take_bodies, by_bodies; /* the system has articulated bodies for it; formulations that can use them do */
    kmp_partition part;
    kmp_rank_margin margin;
    kmp_formulation *formulation;
    const kmp_formulation_kind *method; /* the chosen formulation, also near change points */
    bool brief;                         /* the formulation before lasted for a few steps */
    bool early; /* programs are made where a formulation begins, as for the rows of a recording */
    const kmp_solver_kind *kind;
    kmp_solver *solver;
    kmp_resting resting;
    kmp_passage change_point;
    kmp_runner_room room;
    kmp_turned turned;
    kmp_sticking sticking;
    kmp_runner_events events;
    kmp_stops stops;
    kmp_sampler *sampler;      /* NULL without sampled states */
    struct kmp_delays *delays; /* NULL without delayed signals */
    kmp_work_balance balance;
    double rate_scale, build_s;
    unsigned long memory_failures; /* at the creation of the run */
    kmp_run_report before;         /* work of earlier formulations and solvers */
    kmp_run_log own, *log;         /* the caller's log, or the run's own */
    long centrings;
    long restarted;  /* attempted steps at the last restart for inputs */
    long rescued_at; /* number of attempted steps at the last restart of a stopped integrator */
    char *reason;
    bool locks;
    bool cut; /* given up for spec.limit_s */
    kmp_runner_bounds bounds;
    kmp_growth growth;
    kmp_time_scales scales;         /* of the functions of time */
    kmp_time_scales scales_at_rest; /* of all of them, while friction sticks or a contact is closed, or always: */
};
