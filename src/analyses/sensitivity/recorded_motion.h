/* SPDX-License-Identifier: BSD-3-Clause */
/* A motion without sensitivities, recorded for the adjoint method (adjoint.c): u and ud within each step, the maps of
 * its events and of its changes of u, and its end with the value of the scalar there. It is read backwards, a segment
 * of steps at a time. */
#pragma once

#include "analyses/sensitivity/forward.h"
#include "base/arena.h"

typedef struct kmp_recorded_step {
    struct kmp_recorded_step *before, *behind;
    int p;
    double from, to;
    double values[]; /* of u and ud at some times: 2 p each */
} kmp_recorded_step;

typedef struct kmp_recorded_map {
    struct kmp_recorded_map *before;
    kmp_forward_map of;            /* its arrays are copies, but for: */
    kmp_partition part;            /* behind it */
    const kmp_recorded_step *last; /* before it; NULL: none */
} kmp_recorded_map;

typedef struct kmp_recorded_motion {
    kmp_arena arena;
    kmp_sensitivity_equations *v;
    const kmp_forward_target *target;
    kmp_recorded_step *end;                       /* the last one; NULL: none */
    kmp_recorded_map *map;                        /* the last one */
    int requirements;                             /* of all maps */
    int held;                                     /* rows of friction */
    const int *row;                               /* which are these */
    size_t bytes;                                 /* of steps and maps */
    double value;                                 /* of the target at the end, unless it is an integral */
    double *q;                                    /* n: at the end of the last step */
    double *own_chart, *own_q, *own_qd, *own_qdd; /* the end in the user's coordinates: charts; n */
    const kmp_recorded_step *first, *last, *at;   /* the segment that is read, and the last step used */
} kmp_recorded_motion;

/** Makes room. False: no memory. */
bool kmp_recorded_motion_init(kmp_recorded_motion *motion, kmp_sensitivity_equations *varied,
                              const kmp_forward_target *target);
void kmp_recorded_motion_free(kmp_recorded_motion *motion);

/** The callbacks that record a motion. */
kmp_sensitivity_equations_watch kmp_recorded_motion_watch(kmp_recorded_motion *motion);

/** Takes a segment: the steps up to `last` that are after `before` and begin at `since` or later; `last` in any
 * case. */
void kmp_recorded_motion_take(kmp_recorded_motion *motion, const kmp_recorded_step *before,
                              const kmp_recorded_step *last, double since);

/** The nearest time of the segment. */
double kmp_recorded_motion_time(const kmp_recorded_motion *motion, double t);

/** u and ud (p each) at such a time. The second function: at t within a step. */
void kmp_recorded_motion_at(kmp_recorded_motion *motion, double t, double *y);
void kmp_recorded_step_at(const kmp_recorded_step *step, double t, double *y);

/** True if steps end between a map and the one before it. */
bool kmp_recorded_map_follows_steps(const kmp_recorded_map *map);
