/* SPDX-License-Identifier: BSD-3-Clause */
/* Reference values from a CSV file: columns t, q.NAME, qd.NAME, qdd.NAME, lambda.CLOSURE.k. Fields may be empty, lines
 * beginning with # are comments, columns of other outputs in tables (model/data/output_kinds.def) are skipped. */
#pragma once

#include "model/data/run_settings.h"
#include "output/samples.h"

/** The rows to compare with, times ascending from 0; rows of a run serve as well. */
typedef kmp_samples kmp_reference;

/** KEMPE_E_IO, or KEMPE_E_INPUT with file:line:column for each error (unknown column with the nearest known name, a
 * field that is not a number, times not ascending). */
kempe_status kmp_reference_read(const kempe_system *system, const char *path, kmp_reference *reference);

typedef struct kmp_times {
    int count;
    double *t;
} kmp_times;

/** The time between rows up to t_end: `requested`, or if 0 the model's, or a two hundredth of t_end. If it makes too
 * many rows: KEMPE_E_ARGUMENT for `requested`, KEMPE_E_INPUT with the place of the model's. */
kempe_status kmp_times_spacing(const kempe_system *system, double requested, double t_end, double *every);

/** 0, every, 2 every ... t_end and the reference's times (NULL: none), ascending, none twice. A grid time within
 * rounding of t_end or of a reference time is dropped. every > 0; at most KMP_MOST_ROWS grid times. False: no memory.
 */
bool kmp_times_init(kmp_times *times, double every, double t_end, const kmp_reference *reference);
void kmp_times_free(kmp_times *times);

/** True for two times that are one up to rounding. */
bool kmp_times_are_one(double a, double b);
