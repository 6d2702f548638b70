/* SPDX-License-Identifier: BSD-3-Clause */
/* Residuals of closures of an evaluator, the rows that count in them, and rows that are dropped. */
#pragma once

#include <stdbool.h>

struct kmp_evaluator;

/** Rows that need not be met. */
typedef struct kmp_unmet_rows {
    const bool *left_out; /* m, not owned; NULL: none */
    bool *dropped;        /* m: rows that rounded numbers leave open */
} kmp_unmet_rows;

/** For a system of rounded numbers: marks the rows that a choice drops, or the widest rows at the last
 * kmp_eval_closure. Nothing closes them, so that they no longer count as open; kmp_eval_misfit reports them. */
void kmp_eval_drop(struct kmp_evaluator *eval, int count, const int *rows);
void kmp_eval_drop_widest(struct kmp_evaluator *eval);

/** |h| / row scale of a row at the last kmp_eval_closure; the largest of the dropped rows and its index, -1: none is
 * open. */
double kmp_eval_opening(const struct kmp_evaluator *eval, int row);
double kmp_eval_misfit(const struct kmp_evaluator *eval, int *row);
/** True if a row must be met. */
bool kmp_eval_counts(const struct kmp_evaluator *eval, int row);

/** max |h| / row scale at the last kmp_eval_closure, over the rows that count. */
double kmp_eval_residual(const struct kmp_evaluator *eval);

/** max |J qd + h_t| / row scale at the last kmp_eval_closure, over the rows that count. */
double kmp_eval_rate_residual(const struct kmp_evaluator *eval, const double *qd);

/** The largest |x[i]| / scale (n). */
double kmp_eval_size(const struct kmp_evaluator *eval, const double *x);
