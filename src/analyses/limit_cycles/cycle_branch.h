/* SPDX-License-Identifier: BSD-3-Clause */
/* Limit cycles by shooting, and their branches. */
#pragma once

#include "analyses/sensitivity/sensitivity_study.h"
#include "model/data/force.h"

/* -- a motion over a time -------------------------------------------------------------------------------- */

/* The motion over a time and its derivatives by its start and by one parameter, by forward sensitivities. The state
 * consists of start values: positions and rates of independent coordinates, and states of the model. */

enum { KMP_FLOW_PIECES = 200 }; /* of a period, for extremes */

/** A start value of a motion; a state of the model is the rate of its motion (model/data/model.h). */
typedef enum kmp_flow_kind { KMP_FLOW_POSITION, KMP_FLOW_RATE, KMP_FLOW_STATE } kmp_flow_kind;
typedef struct kmp_flow_entry {
    int motion;
    kmp_flow_kind kind;
} kmp_flow_entry;

/** "q", "qd", "state": with a point and the name, the number of the start value among the parameters of a run. */
extern const char *const kmp_flow_kinds[];
const char *kmp_flow_name(const kempe_model *model, const kmp_flow_entry *entry);

typedef struct kmp_flow {
    kempe_context *context;
    const kempe_system *system;
    kmp_arena arena; /* of all arrays */
    kmp_slope_runs *runs;
    const kempe_sensitivity *rows; /* of the last run: a column for each output */
    double rtol;
    int size; /* of the state */
    kmp_flow_entry *entry;
    double *values; /* size + 1: of the parameters of the runs, the varied one last */
    double *sizes;  /* likewise */
    double *times;  /* KMP_FLOW_PIECES + 1 */
    int row;        /* to come next */
    int pieces;
    double *begin, *end;           /* size: the state at both ends of the last run */
    double *begin_rate, *end_rate; /* size: its change with time there */
    double *slope;                 /* size x (size + 1): of end - begin by the state at the start and the parameter */
    double *monodromy;             /* size x size: of the end by the state at the start */
    double *history;               /* size x (KMP_FLOW_PIECES + 1): the state at the times of the last run */
} kmp_flow;

/** A flow of a system whose parameter `name` varies, with `outputs` in its rows. KEMPE_E_ARGUMENT, KEMPE_E_FAILED as
 * kmp_slope_runs_new. `entry` (size) is copied. */
kempe_status kmp_flow_new(const kempe_system *system, const char *name, const char *outputs,
                          const kempe_run_options *run, int size, const kmp_flow_entry *entry, kmp_flow **flow);
void kmp_flow_free(kmp_flow *flow);

/** Runs from x (size) with a value of the parameter, with rows at `times`, of which it has `pieces` + 1 that ascend
 * from 0. KEMPE_E_FAILED with its reason, KEMPE_STOPPED. */
kempe_status kmp_flow_run(kmp_flow *flow, const double *x, double value, int pieces);

/* -- a cycle --------------------------------------------------------------------------------------------- */

/* Limit cycles by shooting: Newton's method for a start x, a period T and a value p of the parameter with
 *
 *     y(T; x, p) = x        f(x_0) . (x - x_0) = 0        one more condition on (x, T, p)
 *
 * where f(x_0) is the direction of motion in a cycle nearby, so that x does not move along the cycle. The derivatives
 * are exact. Eigenvalues of dy/dx, Floquet's multipliers, decide stability: one is 1, and all others are
 * inside the unit circle if the cycle attracts (Seydel, Practical Bifurcation and Stability Analysis, 2010, chapter 7).
 */

/** The place of a cycle in a diagram. */
typedef enum kmp_cycle_word {
    KMP_CYCLE_REGULAR,
    KMP_CYCLE_HOPF,      /* of no amplitude, where the equilibrium changes its stability */
    KMP_CYCLE_FOLD,      /* the parameter has an extreme value on the branch */
    KMP_CYCLE_DOUBLING,  /* a multiplier is -1 */
    KMP_CYCLE_TORUS,     /* a pair of multipliers is on the unit circle */
    KMP_CYCLE_BRANCHING, /* a multiplier is 1 without a fold */
    KMP_CYCLE_REST       /* no cycle: a simulated motion that has decayed */
} kmp_cycle_word;

typedef enum kmp_cycle_stability { KMP_CYCLE_STABLE, KMP_CYCLE_UNSTABLE, KMP_CYCLE_UNDECIDED } kmp_cycle_stability;

typedef struct kmp_cycle {
    kmp_cycle_word word;
    kmp_cycle_stability stability;
    double *x;            /* size: a state of the cycle */
    double *rate;         /* size: its change with time there */
    double period, value; /* s; of the parameter */
    double *tangent;      /* size + 2: of the branch, for (x, T, p) */
    double *re,
        *im; /* size - 1: multipliers, the largest first, without the multiplier of the motion along the cycle */
    int multipliers;    /* their number; 0: of a Hopf point */
    double along;       /* |m - 1| of that one, which is 1 */
    int growing;        /* multipliers outside the unit circle */
    double *reach;      /* size: half the range of each part of the state */
    double amplitude;   /* the largest amplitude of positions and states, over their characteristic sizes */
    double *high, *low; /* of each output; NaN where it is not periodic */
    double *load;       /* loads: their means over the period */
    double residual;    /* |y(T) - x|, over the reach */
    bool moved;         /* of a simulation: an output that does not drift has changed */
} kmp_cycle;

typedef struct kmp_shooting {
    kmp_flow *flow;
    kmp_arena *cycles;             /* of the cycles */
    kmp_arena arena;               /* of all other arrays */
    int size, width;               /* of the state, of the unknowns: 2 more */
    int loads;                     /* columns of the runs whose means are taken */
    const int *load;               /* their columns; not owned */
    double *z;                     /* unknowns: state, period, parameter */
    double *scale;                 /* width: sizes of parts of the motion, which decide on convergence */
    double *span;                  /* width: sizes of steps along a branch */
    double *whole;                 /* width: the largest motion in each unit */
    double *reference, *direction; /* size: x_0, f(x_0) */
    double *matrix, *right;        /* width x width, width */
    double *copy, *vectors;        /* size x size; four times that */
    double *re, *im;               /* size */
    int *order, *pivot;
    int iterations; /* of the last correction */
} kmp_shooting;

/** `cycles`: where cycles are kept; `load`: columns of the runs whose means are taken, which
 * stay the caller's. KEMPE_E_MEMORY. */
kempe_status kmp_shooting_init(kmp_shooting *shooting, kmp_flow *flow, int loads, const int *load, kmp_arena *cycles);
void kmp_shooting_free(kmp_shooting *shooting);

/** Sets the sizes of the unknowns, which decide on convergence and lengths: of the state (size), of the period
 * and of the parameter. `x` (size): the state itself, whose parts are known to the relative tolerance of the runs, such
 * as the rotation rate of a wheelset. Tolerances of runs follow. */
void kmp_shooting_weigh(kmp_shooting *shooting, const double *x, const double *reach, double period, double parameter);

/** The state near which a cycle begins, and its change with time (size each). */
void kmp_shooting_refer(kmp_shooting *shooting, const double *x, const double *rate);

/** Finds the cycle near the guess (width) on the plane border . (z - guess) = 0, both over the spans. KEMPE_E_FAILED:
 * no convergence. */
kempe_status kmp_shooting_correct(kmp_shooting *shooting, const double *guess, const double *border);

/** Makes a cycle of the unknowns, with a tangent whose product with `border` is positive. KEMPE_E_FAILED,
 * KEMPE_E_MEMORY.
 */
kempe_status kmp_shooting_finish(kmp_shooting *shooting, const double *border, kmp_cycle **cycle);

/** An empty cycle; NULL: no memory. */
kmp_cycle *kmp_shooting_room(kmp_shooting *shooting);

/** "stable", "unstable", "undecided"; "", "Hopf", "fold", "doubling", "torus", "branching", "rest". */
const char *kmp_cycle_stability_text(const kmp_cycle *cycle);
const char *kmp_cycle_text(const kmp_cycle *cycle);

/* -- a branch -------------------------------------------------------------------------------------------- */

/* A branch of limit cycles, followed through its folds by its length (Keller 1977), with requested values of the
 * parameter, folds and changes of stability located on it. */

typedef struct kmp_cycle_branch {
    kmp_cycle **cycle; /* in the order of the branch; kmp_free */
    int count;
    char *end; /* of the caller's arena: why the branch ends, a sentence without full stop */
    bool ends_at_hopf;
} kmp_cycle_branch;

/** The request for a branch; nothing is owned. */
typedef struct kmp_branch_options {
    double from, to; /* of the parameter, in either order: the branch ends beyond them */
    int count;       /* of values between and at them that get a cycle each */
    int most;        /* cycles */
} kmp_branch_options;

/** Follows the branch from a cycle, which it takes, in the direction of its tangent, with sizes as they are. KEMPE_OK
 * also where the branch cannot be followed any more, which `end` says; KEMPE_STOPPED: an interrupt; KEMPE_E_MEMORY. */
kempe_status kmp_branch_follow(kmp_shooting *shooting, const kmp_branch_options *options, kmp_cycle *first,
                               kmp_cycle_branch *branch);

/** Adds a cycle to the list, which is in the arena. KEMPE_E_MEMORY. */
kempe_status kmp_branch_add(kempe_context *context, kmp_arena *arena, kmp_cycle_branch *branch, kmp_cycle *cycle);

/** A piece between two cycles is stable where both are, or one and a fold or a Hopf point at its end. */
bool kmp_cycles_stable_between(const kmp_cycle *a, const kmp_cycle *b);
