/* SPDX-License-Identifier: BSD-3-Clause */
/* Internals of an ensemble: an engine for each thread. Its instances wait in pools, one for each choice of independent
 * coordinates and order of elimination, and pass through the lanes of one pool at a time. No result depends on the
 * other instances of a chunk, nor on the chunks before it. */
#pragma once

#include "backend/lanes.h"
#include "constraints/partition/rank_margin.h"
#include "constraints/partition/reduction.h"
#include "constraints/programs/load_passes.h"
#include "constraints/programs/reduced_program.h"
#include "constraints/programs/saddle_program.h"
#include "ensemble/lanes/ensemble_run.h"
#include "ensemble/lanes/fused_sines.h"
#include "integrators/decide/closing.h"
#include "integrators/decide/endless_growth.h"
#include "integrators/run/events.h"
#include "integrators/run/run.h"
#include "integrators/run/runner.h"
#include "integrators/steppers/rk.h"
#include "model/data/variant.h"
#include <stdatomic.h>

struct kmp_dop853_step;

enum {
    /* Bounds of the lanes; beyond them: separate runs. Lanes of a tree of 29 coordinates are 1.4 times as fast as
     * these, of 40 coordinates 0.9 times; with closures a right-hand side of separate runs takes more. */
    KMP_LANE_ROWS = 127,
    KMP_LANE_TREE = 32,
    KMP_LANE_FREEDOMS = KMP_REDUCED_PROGRAM_MOST,
    KMP_POOLS_KEPT = 64 /* beyond them, an idle one makes room for a new one */
};

/** Numbers of a system that depend on the values of an instance: parameters, scales of coordinates, of rows. */
typedef struct kmp_system_constants {
    double *numbers; /* parameters + n + m */
    double length, reach;
} kmp_system_constants;

/** Signs of the blocks of Jv: one bit for each. */
enum { KMP_SIGN_WORDS = (KMP_LANE_ROWS + 64) / 64 };
typedef struct kmp_lane_signs {
    bool known;
    uint64_t negative[KMP_SIGN_WORDS];
} kmp_lane_signs;

/** An instance between its steps, outside the lanes. */
typedef struct kmp_instance {
    /* each step has these */
    bool rejected;        /* as in struct kmp_rk */
    bool again;           /* the present step is made again up to an event */
    bool has_slope;       /* dy is f(t, y) */
    bool has_step;        /* h is the next step, otherwise it is chosen */
    bool rests;           /* it enters a lane after a rest (lane_steps.h): without the base of its sines */
    int tries;            /* failed attempts since the last accepted step */
    int hopeless;         /* as in struct kmp_rk */
    int next;             /* in the queue of its pool; -1: the last one */
    kmp_lane_signs signs; /* of the blocks of Jv since the start or the last exchange, where it left a lane */
    double *base;         /* of its sines (kmp_fused_sines_get), of `base_size` numbers; both as the signs */
    size_t base_size;
    kmp_work_bound bound;
    kmp_growth growth;
    double limit;               /* |Bvu| at which an exchange is due */
    double longest;             /* step; INFINITY: any */
    double pivot, usual;        /* largest values so far of the least pivots of Jv and of the last pivots of J */
    double seen_margin, seen_t; /* of the last step's end; seen_t -1: none */
    double next_sample;         /* of its states; INFINITY: none */
    double pace;                /* the proposed step, if steps that end at samples are shorter; 0: they are not */
    double end;                 /* where it leaves the lanes: of the run, or of the caller's step (lane_steps.h) */

    kmp_last_correction corrected; /* of v, in weights */
    double t, h, error_old;
    double rate_scale;
    double kinetic, potential;   /* at the start */
    kmp_present_inputs inputs;   /* during its present step */
    double *y, *dy;              /* size */
    double *vdd;                 /* n + m: accelerations of v there and multipliers, where conditions need them */
    double *nu;                  /* m: multipliers there, where forces depend on them */
    double *mode;                /* of each condition */
    kmp_condition_past *past;    /* the same */
    void *memory;                /* of its past at the site (kmp_runner_keep_memory) */
    bool stood;                  /* it has begun there */
    bool returns;                /* lanes may take it back from a stepper (lane_steps.h) */
    struct kmp_lane_group *home; /* the pool in which it rests (lane_steps.h); NULL: it does not */
    kmp_system_constants constants;
} kmp_instance;

/** True for an instance whose slope, signs or sines are not known in a lane. */
static inline bool kmp_instance_is_new(const kmp_instance *x)
{
    return !x->signs.known || x->rests;
}

/** One choice of u and of independent rows with one order of elimination. */
typedef struct kmp_lane_group {
    kmp_partition part;
    kmp_reduction red;
    int *order; /* r */
    kmp_program *program;
    kmp_lanes *lanes;
    kmp_fused_sines sines; /* of these */
    kmp_reduced_program_layout layout;
    int slopes;                 /* the stage that has them */
    bool timed;                 /* it takes the time or inputs */
    kmp_lanes_output *output;   /* of that stage */
    double **place;             /* of each unknown in the program; NULL: it does not have it */
    kmp_eliminated *row;        /* of multipliers */
    unsigned char *pivot_block; /* block of each pivot of Jv */
    kmp_load_passes loads;      /* of multipliers that forces depend on */
    kmp_saddle_program_layout completing;
    kmp_program
        *complete; /* accelerations and multipliers of q and qd, for quantities of them (kmp_saddle_program_write) */
    kmp_lanes *complete_lanes; /* NULL: it is not needed, or there is none */
    int head, tail, waiting;   /* instances; -1: none */
    int kept;                  /* instances that rest here, or return here if their step fails (lane_steps.h) */
    unsigned long used;        /* the find that gave it last */
} kmp_lane_group;

/** Instances of a run that have come to their end, of all engines. */
typedef struct kmp_ensemble_done {
    atomic_long done;
    long total;
} kmp_ensemble_done;

/** The lanes of the current pool: vectors have width doubles per component. */
typedef struct kmp_lane_state {
    size_t w;
    int who[KMP_LANES_MOST]; /* instance, -1: none */
    double t[KMP_LANES_MOST], h[KMP_LANES_MOST], t_new[KMP_LANES_MOST], error[KMP_LANES_MOST];
    double step[KMP_LANES_MOST];
    double until[KMP_LANES_MOST],
        limit[KMP_LANES_MOST]; /* ends of the inputs' pieces; times that no step goes beyond */
    double error_old[KMP_LANES_MOST], next[KMP_LANES_MOST]; /* of the last accepted step; the step after this one */
    /* attempts that need no decision of the instance: the most; accepted and rejected ones not yet in its account */
    int64_t spare[KMP_LANES_MOST], made[KMP_LANES_MOST], repeated[KMP_LANES_MOST];
    int64_t rejected[KMP_LANES_MOST], tries[KMP_LANES_MOST]; /* counts of the instances */
    bool gaps;                                               /* some lane has no instance */
    double bad[KMP_LANES_MOST];                              /* not 0: the right-hand side cannot be evaluated */
    /* values of the instances: pivot, limit, longest */
    double pivot[KMP_LANES_MOST], exchange[KMP_LANES_MOST], longest[KMP_LANES_MOST];
    uint64_t negative[KMP_SIGN_WORDS * KMP_LANES_MOST]; /* theirs, word by word */
    double *y, *y_new, *stage, *weight, *atol;          /* size: room for the largest */
    double *k[17];                                      /* size, as published: 1 to 13; for dense output to 16 */
    double *scale;                                      /* n */
    double *row_scale;                                  /* m */
    double *per_scale, *per_row_scale;                  /* n, m: reciprocal */
    double *square;                                     /* m x n, of one lane */
    double *vdd, *vdd_new, *vdd_middle;                 /* n + m, where conditions need them */
    bool late;                                          /* conditions depend on accelerations or multipliers */
    double *nu, *nu_now, *nu_end; /* m, where forces depend on multipliers: from which they are solved for, at the last
                                   * evaluation, at the end of the step */
    double event[KMP_LANES_MOST]; /* time of one within the step */
    bool dense_bad[KMP_LANES_MOST];     /* the dense output of the present step is not available */
    double *at;                         /* time of an evaluation, then the inputs there */
    bool anew;                          /* the slope of some lane is to be evaluated again */
    int out[KMP_LANES_MOST], out_count; /* instances that have left for a separate run */
} kmp_lane_state;

enum { KMP_LANE_VECTORS = 8 }; /* of the interpolant */

/** The lane whose states within its present step are asked for. */
typedef struct kmp_lane_within {
    kmp_lane_group *pool;
    size_t lane;
    bool current;                     /* its instance is the current one */
    bool ready;                       /* the interpolant is known */
    double *vector[KMP_LANE_VECTORS]; /* size: the interpolant */
    double *y, *udd;                  /* size: unknowns; their second derivatives */
} kmp_lane_within;

typedef struct kmp_lane_conditions kmp_lane_conditions;

/** One thread's share of an ensemble: its system and its lanes. It runs one chunk of instances after another.
 */
struct kmp_measuring;

typedef struct kmp_engine {
    kempe_context *context; /* the model's, or its own, which reports no progress */
    bool own_context;
    kmp_variant *variant;
    kempe_system *s;
    int n, m, parameters;
    int p, r, size;           /* of the pool in the lanes */
    int columns;              /* number of names */
    kmp_system_constants own; /* of the model's own values */

    /* of a run */
    kmp_run_spec spec;
    kmp_ensemble_execution execution;
    kmp_ensemble_done *all;
    kmp_evaluator *eval;
    double *state;                 /* 4 n: of the current instance */
    kmp_lane_group **pools;        /* a list */
    const kmp_lane_group *running; /* NULL: none */
    unsigned long finds;
    kmp_arena run_arena;   /* of the lanes and the state */
    kmp_partition swapped; /* room for one */
    kmp_lane_state room;
    kmp_ensemble_work work;
    int pool_count;
    struct kmp_measuring *measuring; /* of quantities; NULL: there are none */
    kmp_lane_within within;
    kmp_lane_conditions *conditions; /* NULL: there are none */
    kmp_lanes *beside[2];            /* programs of quantities and conditions in lanes; NULL: there is none */
    kmp_runner *site;                /* where instances are between steps; NULL: nothing happens to them there */
    void *fresh;                     /* the memory of a motion that begins */
    kmp_time_scales pulses;          /* of an instance whose functions of time have too many short intervals */

    /* of a chunk */
    int count;
    const double *values; /* count x columns */
    kmp_arena arena;      /* of the instances and their arrays */
    kmp_instance *instances;
    kmp_ensemble_result *results;
    double *q, *qd;               /* count x n */
    double *taken;                /* count x values of the quantities; NULL: there are none */
    double *starts;               /* count x 2 n, as in kmp_ensemble_execution */
    struct kmp_lane_steps *steps; /* instances stay from one step of the caller to the next; NULL: they do not */
} kmp_engine;

/* ensemble_engine.c */

/* ensemble_start.c: one instance at a time. Statuses concern the whole ensemble: memory. */

/* ensemble_conditions.c: states within the present step of a lane */

#define KMP_LANE_SINGULAR_ANGLES "a spherical joint near the singular position of its angles"
#define KMP_LANE_NO_STATES       "states between steps that are not available"

/* ensemble_conditions.c: conditions of instances */

/* ensemble_engine.c: tests at the end of steps */

/** Values of a pool's last stage at the end of the present steps, by lanes. */
typedef struct kmp_lane_watched {
    const double *multiplier, *pivot, *h, *jacobian, *b, *dv;
    bool has_jacobian; /* J is there, too */
    double residual[KMP_LANES_MOST], correction[KMP_LANES_MOST], growth[KMP_LANES_MOST], least[KMP_LANES_MOST];
    double margin[KMP_LANES_MOST]; /* over its usual size; infinite: far from any change point */
    double rows[KMP_LANES_MOST];   /* largest dependence of a dropped row on the kept ones; 0: small */
    uint64_t negative[KMP_SIGN_WORDS * KMP_LANES_MOST]; /* signs of the blocks of Jv (kmp_lanes_signs) */
    int64_t
        quiet[KMP_LANES_MOST]; /* v is corrected, and neither pivots nor |Bvu| nor a limit of time need a decision */
} kmp_lane_watched;

/* ensemble_conditions.c: what happens to one instance between its steps, as in a run */

#define KMP_LANE_SMOOTH "friction that is regularised for a time"

/* ensemble_measure.c: quantities of instances */

/* ensemble_start.c: separate runs. */

/* lane_state.c */

/** The largest number of unknowns in lanes. */
static inline int kmp_lane_most(const kmp_engine *e)
{
    return 2 * e->n + e->s->dissipative;
}

/* ensemble_kernels.c: the arithmetic of DOP853 on vectors of lanes, in the order of operations of dop853.c, with fused
 * multiply-adds */

/** out = y + h sum a[j] k[j]; h has one value per lane. A component with a place is written there, too. */
typedef struct kmp_lanes_sum {
    const double *y, *h;
    int terms;
    const double *a;
    const double *const *k;
    double *out, *const *place;
} kmp_lanes_sum;

/** Attempts of steps in all lanes. Accepted ones that need no decision give the times, step sizes and errors of the
 * next step, rejected ones the next size. */
typedef struct kmp_lane_attempts {
    double failed[KMP_LANES_MOST];                     /* not 0: a stage */
    int64_t on[KMP_LANES_MOST], stays[KMP_LANES_MOST]; /* in which lanes; in which of them the step is made again */
    bool all;                                          /* in all lanes */
    bool none_stays;
} kmp_lane_attempts;
