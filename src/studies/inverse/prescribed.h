/* SPDX-License-Identifier: BSD-3-Clause */
/* A motion given by points in time: values of some coordinates, with their rates and accelerations where these are
 * given too. Missing rates are the derivatives of the not-a-knot cubic through the values, missing accelerations those
 * of the cubic through the rates. Between points the motion is the quintic with value, rate and acceleration of both
 * ends. It has two continuous derivatives and reproduces all given values. */
#pragma once

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

/** An error of a table: the coordinate whose column has a missing value, and the row; coordinate -1: none. */
typedef struct kmp_gap_in_table {
    int coordinate, row, order; /* order: of value */
} kmp_gap_in_table;

/** A motion from columns of n coordinates (rows x n, NaN where no value is given), which must be given in every row or
 * in none. q alone determines the coordinates. False: a missing value, or no memory (coordinate -1). */
bool kmp_prescribed_init(kmp_prescribed *motion, int rows, const double *t, int n, const double *q, const double *qd,
                         const double *qdd, kmp_gap_in_table *gap);
void kmp_prescribed_free(kmp_prescribed *motion);

/** Values, rates and accelerations at t, each at its coordinate. t must be within the given times; at a row's time the
 * values are exactly those of the row. */
void kmp_prescribed_at(const kmp_prescribed *motion, double t, double *q, double *qd, double *qdd);
