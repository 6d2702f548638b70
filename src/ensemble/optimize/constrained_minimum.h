/* SPDX-License-Identifier: BSD-3-Clause */
/* The least value of a function of several variables in the unit cube under inequalities c(x) <= 0, by NLopt (Johnson
 * 2007): with slopes by sequential quadratic programming (SLSQP, Kraft 1994), without them by linear approximations
 * (COBYLA, Powell 1994). A place where the function does not exist has a value above all others, so that the search
 * takes a shorter step. */
#pragma once

#include "ensemble/fit/nonlinear_squares.h"

/** Evaluates the function and `limits` inequalities, in their sizes, with slopes (count; limits x count, row-major)
 * where they are requested. */
typedef kmp_lm_message kmp_minimum_fn(void *user, const double *x, double *value, double *slope, double *limit,
                                      double *limit_slope);

typedef struct kmp_minimum {
    int count, limits;
    bool slopes;
    double tolerance, kept; /* of value and x, relative; inequalities are kept to the second one */
    int most;               /* evaluations */
    kmp_minimum_fn *at;
    void *user;
} kmp_minimum;

typedef struct kmp_minimum_report {
    kmp_squares_outcome outcome;
    int evaluations, refused; /* where the function did not exist */
    double value, broken;     /* the best; the largest c there */
} kmp_minimum_report;

/** False: this build has no library of optimisation. */
extern const bool kmp_minimum_available;

/** x: the start in the cube, then the best place: of the points that keep the inequalities the one of least value, or
 * the one that breaks them least. False: no memory, or not available. */
bool kmp_minimum_find(const kmp_minimum *minimum, double *x, kmp_minimum_report *report);
