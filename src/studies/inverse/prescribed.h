/* SPDX-License-Identifier: BSD-3-Clause */
/* A motion given by points in time: values of some coordinates, with their rates and accelerations where these are
 * given too. What is not given is made: rates are the slopes of the not-a-knot cubic through the values, accelerations
 * those of the one through the rates. Between points runs the quintic that has value, rate and acceleration of both
 * ends: two continuous derivatives, and all that is given is kept. */
#ifndef KMP_STUDIES_INVERSE_PRESCRIBED_H
#define KMP_STUDIES_INVERSE_PRESCRIBED_H

#include "base/arena.h"

typedef struct kmp_prescribed {
    kmp_arena arena; /* of all arrays */
    int count;       /* of coordinates */
    int *coordinate; /* ascending */
    int rows;
    double *t;        /* rows, ascending */
    double *value[3]; /* rows x count each: values, rates, accelerations */
    bool *given[3];   /* count each: they were, and not made */
} kmp_prescribed;

/** What is wrong with a table: the coordinate whose column has a gap, and the row; coordinate -1: nothing. */
typedef struct kmp_gap_in_table {
    int coordinate, row, order; /* order: of value */
} kmp_gap_in_table;

/** From columns of n coordinates (rows x n, not a number where nothing is given), which must be given in every row or
 * in none. q alone decides which coordinates there are. false: a gap, or no memory (coordinate -1). */
bool kmp_prescribed_init(kmp_prescribed *motion, int rows, const double *t, int n, const double *q, const double *qd,
                         const double *qdd, kmp_gap_in_table *gap);
void kmp_prescribed_free(kmp_prescribed *motion);

/** Values, rates and accelerations at t, each at its coordinate, which is within the times given: exactly those of a
 * row at its time. */
void kmp_prescribed_at(const kmp_prescribed *motion, double t, double *q, double *qd, double *qdd);

#endif
