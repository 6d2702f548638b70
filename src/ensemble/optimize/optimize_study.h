/* SPDX-License-Identifier: BSD-3-Clause */
/* Parameters for which a quantity is least: searches, their result, its text and tables. */
#pragma once

#include "ensemble/fit/bounded.h"
#include "ensemble/optimize/constrained_minimum.h"
#include "ensemble/optimize/objective.h"
#include <kempe/optimize.h>

/** An evaluation: NaN where the model did not run. */
typedef struct kmp_trial {
    double value, broken;
} kmp_trial;

/** One search. */
typedef struct kmp_searched {
    int number; /* of its start */
    bool begun;
    double *x; /* its start, then the best place */
    double value, broken;
    int evaluations, refused;
    kmp_squares_outcome outcome;
    kmp_trial *tried;
    int tried_count;
    char *refusal; /* of the last trial at which the model did not run; NULL: there is none */
} kmp_searched;

struct kempe_optimum {
    kempe_context *context;
    const kempe_model *model;
    kmp_arena arena;
    kmp_box_bounds bounded;
    kmp_objective objective;
    kmp_variant *variant; /* of the optimum, for its page */
    bool most_wanted;     /* the largest value */
    const char *quantity, *limit_words, *method;
    int count, limits, starts, pool, most, refused, evaluations;
    double tolerance;
    double *start, *value;
    double *values, *at_best; /* of all quantities: at a hundredfold tolerance, and at the optimum */
    double coarser; /* change of the quantity there at a hundredfold tolerance; NaN: the model does not run with it */
    int threads, searches;
    kmp_searched *search;
    int best; /* search; -1: none */
    double seconds;
    kempe_status status;
    char *reason, *warnings;
};

/** The largest part by which limits are not kept: over the bound, or over 1 where it is 0. */
double kmp_optimum_broken(const kempe_optimum *optimum, const double *values, double *limit);
