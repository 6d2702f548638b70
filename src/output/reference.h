/* SPDX-License-Identifier: BSD-3-Clause */
/* Reference values from a CSV file: columns t, q.NAME, qd.NAME, qdd.NAME, lambda.CLOSURE.k. Fields may be empty, lines
 * beginning with # are comments, columns of other outputs in tables (model/output_kinds.def) are skipped. */
#ifndef KMP_OUTPUT_REFERENCE_H
#define KMP_OUTPUT_REFERENCE_H

#include "output/samples.h"

typedef struct kmp_reference {
    int rows;
    double *t;                     /* ascending, >= 0 */
    double *value[KMP_QUANTITIES]; /* rows x n (or m); NaN where not given */
    const bool *shared; /* m, not its own: multipliers that redundant rows leave open, not judged; NULL: none */
} kmp_reference;

/** KEMPE_E_IO, or KEMPE_E_INPUT with file:line:column for each error (unknown column with the nearest known name, a
 * field that is not a number, times not ascending). */
kempe_status kmp_reference_read(const kempe_system *system, const char *path, kmp_reference *reference);

/** The rows of a table as reference; false: no memory. */
bool kmp_reference_from_table(kmp_reference *reference, const kmp_samples *table);

/** Forgets the rows after t_end. */
void kmp_reference_limit(kmp_reference *reference, double t_end);
void kmp_reference_free(kmp_reference *reference);

#endif
