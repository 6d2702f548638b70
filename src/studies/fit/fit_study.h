/* SPDX-License-Identifier: BSD-3-Clause */
/* Parameters from measured motions: the fit, its statistics, its text and tables. */
#pragma once

#include "linalg/nonlinear_squares.h"
#include "studies/fit/bounded.h"
#include "studies/fit/measured.h"
#include <kempe/fit.h>

typedef enum kmp_fit_state {
    KMP_FIT_INSIDE,
    KMP_FIT_LOWER, /* at its lower bound */
    KMP_FIT_UPPER,
    KMP_FIT_OPEN /* the data does not determine it */
} kmp_fit_state;

struct kempe_fit {
    kempe_context *context;
    const kempe_model *model;
    kmp_arena arena;       /* of all arrays */
    kmp_slope_runs *runs;  /* their equations; the rows are those of the estimates at the end */
    kmp_measured measured; /* data column c is column[c] of the rows */
    const char *file;      /* of the data */
    kmp_bounded bounded;
    int count, *column; /* parameters */
    char **name;
    double *lower, *upper, *start, *value, *error, *low, *high;
    kmp_fit_state *state;
    double *deviation, *rms;   /* by data column */
    bool *exact;               /* residuals are errors of the runs */
    int *number;               /* of measurements in each */
    bool given;                /* deviations are */
    int residuals, freedoms;   /* known measurements; less the free parameters */
    double *motion;            /* rows x columns: of the estimates, as fitted */
    double *residual, *slope;  /* weighted; residuals x count, column-major */
    double *best, size;        /* the best values so far, and the sum of squares there, with these weights */
    double *correlation;       /* count x count; NaN */
    double scatter;            /* root of the weighted sum of squares by the degrees of freedom */
    double confidence, factor; /* of the intervals: half the width over the standard error */
    double condition;          /* of the scaled Jacobian */
    int rank, free;            /* parameters that are not at bounds */
    double coarser;            /* the largest change of a fitted value at another tolerance, in deviations; NaN */
    int starts, searches;
    int most, evaluations, iterations, refused, rounds; /* of the weights */
    kmp_squares_outcome outcome;
    kempe_status status; /* of the last run */
    char *refusal;       /* reason of the last refused trial; NULL: none */
    char *reason, *warnings;
};

/** Weighted residuals and their derivatives at the last rows. */
void kmp_fit_weigh(kempe_fit *fit, double *residual, double *slope);

/** Standard errors, intervals, correlation and rank from the residuals and their derivatives. KEMPE_E_MEMORY. */
kempe_status kmp_fit_judge(kempe_fit *fit);

/** A sentence about each set of parameters that the data does not determine. */
void kmp_fit_put_open(const kempe_fit *fit, kmp_text *text);
