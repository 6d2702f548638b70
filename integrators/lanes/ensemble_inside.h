/* SPDX-License-Identifier: BSD-3-Clause */
/* The inside of an ensemble: instances wait in pools, one a choice of independent coordinates and order of elimination,
 * and go through the lanes of one pool at a time. */
#ifndef KMP_INTEGRATORS_LANES_ENSEMBLE_INSIDE_H
#define KMP_INTEGRATORS_LANES_ENSEMBLE_INSIDE_H

#include "backend/lanes.h"
#include "constraints/evaluation/fused_inside.h"
#include "constraints/partition/margin.h"
#include "constraints/partition/reduction.h"
#include "constraints/tolerances.h"
#include "integrators/lanes/ensemble.h"
#include "integrators/run/work_bound.h"
#include "integrators/steppers/rk.h"
#include "model/variant.h"

enum { KMP_POOLS_MOST = 64, KMP_LANE_ROWS = 24 }; /* more choices, and mechanisms with more rows, run by themselves */

/** Between its steps, out of the lanes. */
typedef struct kmp_instance {
    int next;       /* in the queue of its pool; -1: the last one */
    bool has_slope; /* dy is f(t, y) */
    bool has_step;  /* h is the next step, otherwise it is chosen */
    bool rejected;  /* as struct kmp_rk has these */
    uint32_t signs; /* a bit a block of Jv since the start or the last exchange, and one more; 0: not known yet */
    int hopeless;
    kmp_work_bound bound;
    int tries; /* in vain, since the last accepted step */
    double t, h, error_old;
    double rate_scale, limit;   /* the |Bvu| that asks for an exchange */
    double pivot, usual;        /* the largest seen of the least pivots of Jv and of the last pivots of J */
    double seen_margin, seen_t; /* of the last step's end; seen_t -1: nothing */
    double length, reach;
    double kinetic, potential; /* at the start */
    double *y, *dy;            /* size */
    double *constants;         /* parameters, scales of coordinates, of rows */
} kmp_instance;

/** One choice of u, and one order of elimination. */
typedef struct kmp_pool {
    kmp_partition part;
    kmp_reduction red;
    bool has_part, has_red;
    int *order; /* r */
    kmp_program *program;
    kmp_lanes *lanes;
    kmp_fused_layout layout;
    int head, tail, waiting; /* instances; -1: none */
} kmp_pool;

/** The lanes of the pool at hand: vectors are width doubles a component. */
typedef struct kmp_lane_room {
    size_t w;
    int who[KMP_LANES_MOST]; /* instance, -1: none */
    double t[KMP_LANES_MOST], h[KMP_LANES_MOST], t_new[KMP_LANES_MOST], error[KMP_LANES_MOST];
    double step[KMP_LANES_MOST];
    double bad[KMP_LANES_MOST]; /* not 0: the right-hand side cannot be had */
    double *memory;
    double *y, *y_new, *stage, *weight, *atol; /* size */
    double *k[14];                             /* size, as published: 1 to 13 */
    double *scale;                             /* n */
    double *row_scale;                         /* m */
    double *at;                                /* time of an evaluation */
} kmp_lane_room;

struct kmp_ensemble {
    kempe_context *context;
    kmp_variant *variant;
    kempe_system *s;
    int n, m, p, r, size, parameters; /* p, r and size: of the lanes */
    int columns;                      /* names */
    double *unit_row_scale;           /* m: of the model's own values */

    /* of a run */
    kmp_run_spec spec;
    kmp_ensemble_way way;
    kmp_plant *plant;
    int count;
    const double *values;
    kmp_arena arena; /* of the instances and their arrays */
    kmp_instance *instances;
    kmp_ensemble_result *results;
    double *q, *qd; /* count x n */
    double *state;  /* 4 n: of the instance at hand */
    kmp_pool *pools[KMP_POOLS_MOST];
    int pool_count;
    kmp_lane_room room;
    double told; /* when progress was */
    kmp_ensemble_work work;
};

/* ensemble_start.c: one instance at a time. Statuses are for the whole: memory. */

/** Why lanes can run no instance; NULL: they can. */
const char *kmp_ensemble_no_lanes(const kmp_ensemble *e);

/** Assembles an instance and puts it into a pool, or leaves it to a run of its own, or says in its result why not. */
kempe_status kmp_instance_start(kmp_ensemble *e, int i);
/** Its next choice of u, from t and y. */
kempe_status kmp_instance_exchange(kmp_ensemble *e, kmp_pool *from, int i);
/** The same choice in an order of elimination that is good there. */
kempe_status kmp_instance_reorder(kmp_ensemble *e, kmp_pool *from, int i);
/** Its result, from t and y. */
kempe_status kmp_instance_finish(kmp_ensemble *e, kmp_pool *pool, int i);
/** By a run of its own, from its start. */
kempe_status kmp_instance_alone(kmp_ensemble *e, int i);
/** It leaves the lanes for such a run. */
void kmp_instance_leave(kmp_ensemble *e, int i, const char *why);

/* ensemble_pool.c */

/** The pool for a partition, whose Jv at the plant's last closure says how rows are eliminated; NULL in *pool: there
 * are too many, or it cannot be written. */
kempe_status kmp_pool_find(kmp_ensemble *e, const kmp_partition *part, kmp_pool **pool);
void kmp_pool_free(kmp_pool *pool);
void kmp_pool_put(kmp_ensemble *e, kmp_pool *pool, int i);
int kmp_pool_take(kmp_ensemble *e, kmp_pool *pool);

/* ensemble_lanes.c */

bool kmp_lane_room_init(kmp_lane_room *room, const kmp_ensemble *e, int width);
void kmp_lane_room_free(kmp_lane_room *room);

/** Runs a pool until nothing is left in it, or until another has more to do. */
kempe_status kmp_pool_run(kmp_ensemble *e, kmp_pool *pool);

#endif
