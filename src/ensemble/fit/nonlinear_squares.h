/* SPDX-License-Identifier: BSD-3-Clause */
/* Nonlinear least squares with bounds: the least sum of squares of residuals r(x), lower <= x <= upper, by
 * Levenberg-Marquardt steps in a trust region (Moré 1978: lmder of MINPACK, here cminpack). A bounded variable is a
 * smooth function of a free one, as in MINUIT: a sine between two bounds, a hyperbola above or below a single one. At
 * a place where r does not exist the step is shortened to a tenth. */
#pragma once

#include <stdbool.h>

typedef enum kmp_lm_message {
    KMP_SQUARES_GO,
    KMP_SQUARES_NOWHERE, /* r does not exist there: a shorter step */
    KMP_SQUARES_END      /* the search ends */
} kmp_lm_message;

/** Evaluates r (rows) and its derivatives (rows x count, column-major) at x. */
typedef kmp_lm_message kmp_squares_fn(void *user, const double *x, double *residual, double *jacobian);

typedef struct kmp_squares {
    int rows, count;             /* rows >= count */
    const double *lower, *upper; /* count, also infinite: lower < upper */
    double tolerance;            /* relative, of the sum of squares and of x */
    int most;                    /* evaluations */
    kmp_squares_fn *at;
    void *user;
} kmp_squares;

typedef enum kmp_squares_outcome {
    KMP_SQUARES_FOUND,
    KMP_SQUARES_MOST,    /* evaluations: not yet a minimum */
    KMP_SQUARES_ENDED,   /* by KMP_SQUARES_END */
    KMP_SQUARES_NO_START /* r does not exist at the start */
} kmp_squares_outcome;

typedef struct kmp_squares_report {
    kmp_squares_outcome outcome;
    int iterations, evaluations, refused; /* accepted steps; evaluations of r; where r did not exist */
} kmp_squares_report;

/** False: this build has no library of least squares. */
extern const bool kmp_squares_available;

/** x: the start within the bounds, then the best place known. A start at a bound is moved inside by a hundredth. False:
 * no memory, or not available. */
bool kmp_squares_minimise(const kmp_squares *squares, double *x, kmp_squares_report *report);
