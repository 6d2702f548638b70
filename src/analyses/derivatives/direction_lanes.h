/* SPDX-License-Identifier: BSD-3-Clause */
/* Small changes of a mechanism along several directions at once, in the lanes of vector registers: the response of
 * accelerations and multipliers of reduction.h, and of all coordinates along closed motions (small_change.h), with the
 * bits that these have for one direction. Value k of lane l is at k width + l. No allocation after
 * kmp_direction_lanes_init. */
#pragma once

#include "constraints/evaluation/tangent.h"
#include "constraints/partition/reduction.h"
#include "constraints/partition/terms.h"
#include "linalg/wide_rows.h"

enum { KMP_DIRECTIONS = KMP_WIDEST }; /* at most */

typedef struct kmp_direction_lanes {
    kmp_arena arena;
    const kmp_reduction *red; /* its choice, and its factors at a state; NULL: there is none */
    int n, m, p, r;
    int width;               /* 4, 8 or KMP_DIRECTIONS */
    int *order, *place;      /* p: u in the order of elimination of the reduced mass; the place of each u there */
    kmp_terms lower, below;  /* the factor of the reduced mass in this order: L by rows, and by columns */
    kmp_terms x, moved;      /* X by columns in this order; Bvu by rows, of columns in the order of u */
    kmp_terms mass, mass_by; /* rows of M, and their part in the columns of v, of positions in v */
    double *force, *curve;   /* n, m: given changes of M qdd + C - J' lambda and of J qdd + jdqd */
    double *h, *rate;        /* m: given ones of h and of J qd + h_t, for kmp_direction_lanes_follow */
    int u[KMP_DIRECTIONS],
        ud[KMP_DIRECTIONS];        /* the independent coordinate that changes by one, or its rate; -1: none */
    int *unit;                     /* 2 p: their lanes, by coordinates; work space */
    double *dq, *dqd;              /* n: changes of all coordinates */
    double *udd, *qdd, *lambda;    /* p, n, m: changes of udd in that order, of qdd and of multipliers */
    double *right, *solved, *load; /* r, r, n: work space */
} kmp_direction_lanes;

/** For a system of n coordinates and m rows, and a reduction (NULL: none), which must outlive it. Zero initially.
 * false: no memory. */
bool kmp_direction_lanes_init(kmp_direction_lanes *lanes, int n, int m, const kmp_reduction *red);
void kmp_direction_lanes_free(kmp_direction_lanes *lanes);

/** Begins with `count` directions, along which nothing changes yet; `follows`: also h, J qd + h_t, u and ud. */
void kmp_direction_lanes_begin(kmp_direction_lanes *lanes, int count, bool follows);

/** Adds the column of a block to a lane of `force` or `curve`, for the derivatives `d` last evaluated. */
void kmp_direction_lanes_add_column(const kmp_direction_lanes *lanes, const kmp_tangents *tangents,
                                    kmp_tangent_block block, const double *d, int column, int lane, double *out);

/** dq and dqd along closed motions, for the given changes of u, ud, h and J qd + h_t, and what they add to `force` and
 * `curve`. */
void kmp_direction_lanes_follow(kmp_direction_lanes *lanes, const kmp_tangents *tangents, const double *d);

/** udd and qdd, and with `pulls` lambda, for `force` and, with `bends`, `curve` (otherwise zero), after
 * kmp_reduction_factor_mass. */
void kmp_direction_lanes_solve(kmp_direction_lanes *lanes, bool bends, bool pulls);

/** udd = Mr^-1 X' e of unit generalized forces e of `count` coordinates from `first` on. */
void kmp_direction_lanes_press(kmp_direction_lanes *lanes, int first, int count);

/** Writes `count` lanes from `lane` on as columns of `rows` numbers; number k of them is in row from[k] (NULL: k) of
 * the values. */
void kmp_direction_lanes_put(const kmp_direction_lanes *lanes, int rows, const int *from, const double *values,
                             int lane, int count, double *columns);
