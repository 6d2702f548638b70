/* SPDX-License-Identifier: BSD-3-Clause */
/* Closed states along a line of driven values: coordinates, and the time, go from one value to another with one
 * parameter s from 0 to 1. What stays closed and follows them is a curve of states x = (q, s), which is led along its
 * arc: predictor on the tangent, corrector by Newton on scaled h across it (pseudo-arclength continuation; Keller 1977,
 * Allgower and Georg 1990), both on q = (u, v) with u chosen freely and well conditioned, so that the curve is regular
 * in a dead centre of what is driven: there s turns, and nothing else happens. A step is accepted when the tangents at
 * its ends differ little, corrections are small and shrink quickly, and no block of Jv has changed its sign between. */
#ifndef KMP_STUDIES_KINEMATICS_SWEEP_H
#define KMP_STUDIES_KINEMATICS_SWEEP_H

#include "base/arena.h"
#include "constraints/partition/margin.h"
#include "constraints/partition/reduction.h"

/** A coordinate, or the time (-1), at from + s (to - from). */
typedef struct kmp_lead {
    int coordinate;
    double from, to;
} kmp_lead;

double kmp_lead_value(const kmp_lead *lead, double s);

/** A state x = (q, s) on the curve and the unit tangent there, in the sweep's units. */
typedef struct kmp_sweep_pose {
    double *x, *dx; /* n + 1 */
} kmp_sweep_pose;

typedef struct kmp_sweep_effort {
    long steps, rejected, newton, exchanges;
} kmp_sweep_effort;

typedef struct kmp_sweep {
    kmp_arena arena, of_choice, of_leads; /* of the rooms; those of u and v, and of what leads, that are there */
    const kempe_system *system;
    kmp_plant *plant; /* its own */
    kmp_partition part;
    kmp_reduction red;
    kmp_margin margin;
    int n, p;
    int count; /* leads: as many coordinates as are wanted beside moving rows to make p; and the time when it is led */
    kmp_lead *lead;
    int time;      /* its lead, -1: it stays 0 */
    double *unit;  /* of x in the arc: scales of coordinates, and s by which a leading one goes by one of them */
    bool *dropped; /* rows that count as none */
    bool any_dropped;
    int *moving, moving_count; /* of these, rows that move in time: they lead, as coordinates do */
    double *masked;            /* J without the rows that are dropped */
    kmp_sweep_pose here, next, part_way, entry;
    double *span;     /* n + 1 rows of p + 1: what each of x changes by along each of u and along s */
    double *gradient; /* p + 1 rows of n + 1: of all that is to be met */
    double *matrix;   /* p + 1 square: its changes along the span */
    double *rhs, *pivots;
    int *order;
    double *drift, *dx, *xs, *xss, *jd; /* scratch */
    int *signs;                         /* of the blocks of Jv where it stands */
    double last_margin, last_step;      /* how it changes */
    double fastest;                     /* the greatest share of s in the motion so far */
    kmp_sweep_effort effort;
} kmp_sweep;

/** `closures`: those that are released. KEMPE_E_MEMORY. */
kempe_status kmp_sweep_init(kmp_sweep *sweep, const kempe_system *system, const char *backend, const bool *closures);
void kmp_sweep_free(kmp_sweep *sweep);

/** Stands at (t, q), closed, and counts the freedoms: p. KEMPE_E_FAILED: a start where branches meet. */
kempe_status kmp_sweep_stand(kmp_sweep *sweep, double t, const double *q);

/** Where it stands, at (t, q), time will go from one value to another: rows that move with it lead, so that the curve
 * is regular where they lock, and each is one of p then. */
kempe_status kmp_sweep_let_move(kmp_sweep *sweep, const kmp_lead *time, double t, const double *q);

/** Brings coordinates (n; room for n + p) into an order in which each determines more: first those that are `given`
 * (n), as many as do not follow from the others, then what would determine the rest with them, best first; p of them.
 * The number of the former, -1: no memory. */
int kmp_sweep_order(kmp_sweep *sweep, const bool *given, int *order);

/** What leads from here on, and s where it stands; the leads' coordinates and moving rows are p. Copied. KEMPE_E_FAILED
 * without message: they do not determine the rest. */
kempe_status kmp_sweep_lead(kmp_sweep *sweep, int count, const kmp_lead *leads, double s);

typedef struct kmp_sweep_task {
    double s_end;
    int count; /* rows wanted, with their s in the order in which they are met */
    const double *s;
    /** A row: state and its derivatives by s (n each); NULL for both where they are infinite. */
    void (*row)(void *user, double s, const double *q, const double *qs, const double *qss);
    /** A change point that was passed: where, and how small the margin was. */
    void (*change)(void *user, const kmp_sweep_pose *pose, double margin);
    void *user;
} kmp_sweep_task;

typedef enum kmp_sweep_end {
    KMP_SWEEP_ON_THE_WAY, /* never at the end */
    KMP_SWEEP_ARRIVED,
    KMP_SWEEP_DEAD, /* a dead centre: it is `here`, ds = 0, the tangent in the direction of the way */
    KMP_SWEEP_LOST, /* steps have come to nothing */
    KMP_SWEEP_INTERRUPTED,
    KMP_SWEEP_NO_MEMORY
} kmp_sweep_end;

/** Goes to s_end, or where that lies in a change point to a state not far below it. From a dead centre it goes back
 * where it came from, towards s_end. */
kmp_sweep_end kmp_sweep_go(kmp_sweep *sweep, const kmp_sweep_task *task);

/** The largest |dq_i| in scales. */
double kmp_sweep_fastest(const kmp_sweep *sweep, const kmp_sweep_pose *pose);

/** How well what is driven determines the rest here: of the leading coordinates' directions among all motions the
 * smallest pivot over the largest; 0 in a dead centre. */
double kmp_sweep_hold(kmp_sweep *sweep, const kmp_sweep_pose *pose);

/** The margin of all rows at a pose (constraints/partition/margin.h). */
double kmp_sweep_margin(kmp_sweep *sweep, const kmp_sweep_pose *pose);

#endif
