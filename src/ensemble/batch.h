/* SPDX-License-Identifier: BSD-3-Clause */
/* Results of an ensemble (kempe/ensemble.h) as its report page reads them, and its runs in parts. */
#pragma once

#include "dynamics/system.h"
#include "ensemble/instance_table.h"
#include "ensemble/quantity_words.h"
#include <kempe/ensemble.h>

const kempe_model *kmp_batch_model(const kempe_ensemble_result *batch);

/** The status of the whole. */
kempe_status kmp_batch_status(const kempe_ensemble_result *batch);

/** Its warnings and doubts, one per line; NULL: there are none. */
const char *kmp_batch_warnings(const kempe_ensemble_result *batch);

/** Processor time of all threads, s. */
double kmp_batch_cpu(const kempe_ensemble_result *batch);

/* -- parts of a longer run --------------------------------------------------------------------------- */

/** Instances first .. first + count - 1; with `rows`, their values instead of the values of the table. Part of a longer
 * run of `total` instances (0: not a part), `before` of which were done: it gives no warnings, and its progress is the
 * progress of the whole. */
typedef struct kmp_batch_range {
    int first, count;
    const double *rows; /* count x columns, NULL: of the table */
    long before, total;
} kmp_batch_range;

/** kempe_ensemble_run_range, or _rows, within a computation that has begun, with the library's copy of `run`. A part
 * whose instances all fail is not a failure. */
kempe_status kmp_batch_new(kempe_ensemble *ensemble, const kempe_run_options *run, int lanes,
                           const kmp_batch_range *range, kempe_ensemble_result **batch);
kempe_status kmp_batch_check_lanes(kempe_context *context, int lanes);

/** Sums of several batches, and their work. */
typedef struct kmp_batch_totals {
    kmp_instance_sums sums;
    long alone;
    int threads;
    double cpu_s;
} kmp_batch_totals;
/** Adds a batch, whose table "instances" is given. */
void kmp_batch_add(const kempe_ensemble_result *batch, const kempe_table *instances, kmp_batch_totals *sum);

/** The table "instances" without rows: all batches of the ensemble have its columns. */
kempe_status kmp_ensemble_columns(kempe_ensemble *ensemble, kempe_table **table);

/** kmp_model_begin_forces for a run of the ensemble, whose instances are doubted where the model is. */
void kmp_ensemble_begin(kempe_ensemble *ensemble);

const kempe_model *kmp_ensemble_model(const kempe_ensemble *ensemble);
const kempe_values *kmp_ensemble_values(const kempe_ensemble *ensemble);
const kmp_quantity_list *kmp_ensemble_quantities(const kempe_ensemble *ensemble);
const kempe_system *kmp_ensemble_equations(const kempe_ensemble *ensemble);
