/* SPDX-License-Identifier: BSD-3-Clause */
/* Outputs of a mechanism other than those that its model requests, at states that are known already: columns of a
 * system derived with these outputs. */
#pragma once

#include "model/variant.h"
#include "studies/simulate/columns.h"

typedef struct kmp_observed {
    kmp_variant *variant;
    kempe_system *system;
    kmp_evaluator *eval;
    kmp_columns columns;
    unsigned *parts; /* by output of its model: a bit for each requested component; NULL: all */
    int left_out;    /* outputs of the model that are not observed */
} kmp_observed;

/** `words`: as `outputs` in the file, each with a component if one alone is requested; NULL: those of the model, then
 * all others of up to `most` columns. KEMPE_E_ARGUMENT: a wrong word. */
kempe_status kmp_observed_init(kmp_observed *observed, const kempe_system *system, const char *words, int most,
                               const char *backend);
void kmp_observed_free(kmp_observed *observed);

/** The values of all columns (columns.count) at a row of samples. */
void kmp_observed_fill(const kmp_observed *observed, const kmp_samples *samples, int row, double *values);

/** True if a column is one that the words request. */
bool kmp_observed_has(const kmp_observed *observed, int column);
