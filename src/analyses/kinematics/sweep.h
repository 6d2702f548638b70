/* SPDX-License-Identifier: BSD-3-Clause */
/* Closed states along a line of driven values: coordinates, and the time, change linearly with one parameter s from 0
 * to 1. The closed states that follow them are a curve x = (q, s), which is followed along its arc. Predictor on the
 * tangent, corrector by Newton on scaled h across it (pseudo-arclength continuation; Keller 1977, Allgower and Georg
 * 1990). Both use q = (u, v) with a free, well-conditioned choice of u, so that the curve is regular in a dead centre
 * of the driven coordinates: there s reverses. A step is accepted when the tangents at its ends differ little,
 * corrections are small and shrink quickly, and no block of Jv has changed its sign. */
#pragma once

#include "base/arena.h"
#include "constraints/partition/rank_margin.h"
#include "constraints/partition/reduction.h"

/** A coordinate, or the time (-1), at from + s (to - from). */
typedef struct kmp_sweep_parameter {
    int coordinate;
    double from, to;
} kmp_sweep_parameter;

/** The largest turn of the tangent from one end of a step to the other, rad. A rate of h above this part of the largest
 * entry of its row turns the curve by as much. */
#define KMP_SWEEP_TURN 0.3

typedef struct kmp_path_bounds kmp_path_bounds; /* analyses/kinematics/path_bounds.h */

/** A state x = (q, s) on the curve and the unit tangent there, in the sweep's units. */
typedef struct kmp_sweep_pose {
    double *x, *dx; /* n + 1 */
} kmp_sweep_pose;

typedef struct kmp_sweep_effort {
    long steps, rejected, newton, exchanges;
} kmp_sweep_effort;

typedef struct kmp_sweep {
    kmp_arena arena, of_choice, of_leads; /* of all arrays; of the current u and v, and driven values */
    const kempe_system *system;
    kmp_evaluator *eval; /* its own */
    kmp_partition part;
    kmp_reduction red;
    kmp_rank_margin margin;
    int n, p;
    int count; /* driven values: as many coordinates as make p with the moving rows; and the time when it is swept */
    kmp_sweep_parameter *parameter;
    int time;      /* its index among the driven values, -1: it stays 0 */
    double *unit;  /* of x in the arc: scales of coordinates, and the s by which a driven one changes by one scale */
    bool *dropped; /* rows that count as none */
    bool any_dropped;
    int *moving,
        moving_count; /* of the dropped rows, the rows that move in time: they are driven, as coordinates are */
    double *masked;   /* J without the rows that are dropped */
    kmp_sweep_pose here, next, between, entry;
    double *span;     /* n + 1 rows of p + 1: derivatives of each x along each of u and along s */
    double *gradient; /* p + 1 rows of n + 1: of all that is to be met */
    double *matrix;   /* p + 1 square: its changes along the span */
    double *rhs, *pivots;
    int *order;
    double *drift, *dx, *xs, *xss, *jd; /* scratch */
    int *signs;                         /* of the blocks of Jv at the current state */
    double last_margin, last_step;      /* change of the margin */
    double fastest;                     /* the greatest share of s in the motion so far */
    kmp_sweep_effort effort;
    kmp_path_bounds *path;
} kmp_sweep;

/** `closures`: the ones that are released. KEMPE_E_MEMORY. */
kempe_status kmp_sweep_init(kmp_sweep *sweep, const kempe_system *system, const char *backend, const bool *closures);
void kmp_sweep_free(kmp_sweep *sweep);

/** Goes to (t, q), closed, and counts the degrees of freedom: p. KEMPE_E_FAILED: branches meet at the start. */
kempe_status kmp_sweep_stand(kmp_sweep *sweep, double t, const double *q);

/** Prepares a sweep of time from the current state (t, q): rows that move in time become driven, so that the curve is
 * regular where they lock. Each is one of p then. */
kempe_status kmp_sweep_let_move(kmp_sweep *sweep, const kmp_sweep_parameter *time, double t, const double *q);

/** Sorts coordinates (n; room for n + p) so that each determines more. First the ones that are `given` (n), as many as
 * do not follow from the others, then the ones that would determine the rest with them, best first; p of them. Returns
 * the number of given ones, -1: no memory. */
int kmp_sweep_order(kmp_sweep *sweep, const bool *given, int *order);

/** Sets the driven values from here on, and s of the current state; driven coordinates and moving rows are p. Copied.
 * KEMPE_E_FAILED without message: they do not determine the rest. */
kempe_status kmp_sweep_along(kmp_sweep *sweep, int count, const kmp_sweep_parameter *parameters, double s);

typedef struct kmp_sweep_task {
    double s_end;
    int count; /* requested rows, with their s in the order of the path */
    const double *s;
    /** A row: state and its derivatives by s (n each); NULL for both where they are infinite. */
    void (*row)(void *user, double s, const double *q, const double *qs, const double *qss);
    /** A change point that was passed: its pose, and its margin. */
    void (*change)(void *user, const kmp_sweep_pose *pose, double margin);
    void *user;
} kmp_sweep_task;

typedef enum kmp_sweep_end {
    KMP_SWEEP_ON_THE_WAY, /* never at the end */
    KMP_SWEEP_ARRIVED,
    KMP_SWEEP_DEAD, /* a dead centre: it is `here`, ds = 0, the tangent in the direction of motion */
    KMP_SWEEP_LOST, /* steps have become too short */
    KMP_SWEEP_INTERRUPTED,
    KMP_SWEEP_NO_MEMORY
} kmp_sweep_end;

/** Goes to s_end, or if that lies in a change point to a state not far below it. From a dead centre it returns in the
 * reverse direction, towards s_end. */
kmp_sweep_end kmp_sweep_go(kmp_sweep *sweep, const kmp_sweep_task *task);

double kmp_sweep_parameter_value(const kmp_sweep_parameter *parameter, double s);

/** The largest |dq_i| in scales. */
double kmp_sweep_fastest(const kmp_sweep *sweep, const kmp_sweep_pose *pose);

/** The conditioning of the driven coordinates here: the smallest pivot over the largest of their directions among all
 * motions; 0 in a dead centre. */
double kmp_sweep_hold(kmp_sweep *sweep, const kmp_sweep_pose *pose);

/** The margin of all rows at a pose (constraints/partition/rank_margin.h). */
double kmp_sweep_margin(kmp_sweep *sweep, const kmp_sweep_pose *pose);
