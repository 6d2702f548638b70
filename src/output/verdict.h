/* SPDX-License-Identifier: BSD-3-Clause */
/* Accuracy of a run: its closure residuals, its energy balance, and its errors relative to a reference. */
#pragma once

#include "constraints/evaluation/evaluator.h"
#include "output/reference.h"

/** Sizes that errors are relative to where a value is smaller: of angles 1 rad, of translations `length`; their rates
 * times `rate`, their accelerations times `acceleration`; `load` of all multipliers, each times the size of its row. */
typedef struct kmp_scales {
    double length, rate, acceleration, load;
} kmp_scales;

/** From the model, and from the largest rate, acceleration and load of a reference; 1 where it has none. */
kmp_scales kmp_verdict_scales(const kempe_system *system, const kmp_reference *reference);

typedef struct kmp_verdict {
    double h_max, hdot_max;       /* largest scaled residual of h and of J qd + h_t */
    double misfit;                /* for rounded numbers: residual of the rows that are dropped as redundant; else 0 */
    int misfit_row;               /* its row; -1: none */
    double misfit_t;              /* when, s */
    double drift_rel;             /* kmp_verdict_drift of max |E - E0 - work|, and of the largest kinetic energy or the
                                     range of the potential energy */
    double left;                  /* this energy over all that is exchanged, the work included */
    double drift;                 /* this energy, J */
    double moved;                 /* largest range of a coordinate or state over its size */
    double error[KMP_QUANTITIES]; /* max |x - ref| / max(|ref|, its scale), of multipliers over the largest load; NaN
                                     where the reference has no values */
} kmp_verdict;

/** An error of the energy over the energy that is exchanged, or over 1e-9 of the potential energy when that is more, as
 * in a mechanism at rest; all in J. */
double kmp_verdict_drift(double drift, double exchanged, double potential);

/** A verdict without results: all NaN. */
kmp_verdict kmp_verdict_none(void);

/** Judges a table, NaN when it is empty. `reference` may be NULL; only rows at exactly its times are compared. */
kmp_verdict kmp_verdict_of(const kmp_samples *table, kmp_evaluator *eval, const kmp_reference *reference);

/** Only the errors, of the rows up to a time. */
void kmp_verdict_errors(const kmp_samples *table, const kempe_system *system, const kmp_reference *reference,
                        double until, double error[KMP_QUANTITIES]);
