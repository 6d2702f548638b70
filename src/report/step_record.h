/* SPDX-License-Identifier: BSD-3-Clause */
/* A repeated run, monitored step by step: its residuals and energy over time, the lengths of its steps, its events. */
#pragma once

#include "base/json.h"
#include "studies/compare/compare_study.h"
#include <kempe/compare.h>

/* Rows of the runs that comparisons show, without the row of the start; ranges of steps. */
enum { KMP_RECORD_ROWS = 600, KMP_RECORD_RANGES = 600 };

/** Consecutive steps, from `t` on: the shortest and the longest of them. */
typedef struct kmp_step_range {
    double t, least, most;
} kmp_step_range;

typedef struct kmp_record {
    kmp_arena arena; /* of the arrays */
    int run;         /* index into the runs of a comparison */
    kmp_samples row; /* of evenly spaced times from the start to t_end, up to the end of the run; where it ends earlier,
                      * also of its last state */
    double *h;       /* per row: max |h|, max |J qd + h_t|, both scaled as in verdicts */
    double *hdot;
    double *energy; /* per row: (E - work - its value in the first row) / size, as in verdicts */
    double *kinetic, *potential;
    kmp_step_range *ranges; /* none of a run in parts, with separate steps */
    int range_count;
    long each; /* steps a range, but for the last */
    kmp_run_log log;
} kmp_record;

/** Runs a resolved spec, whose own times and log are not used, with `rows` rows after the start. `start` as in
 * kmp_run. KEMPE_STOPPED, KEMPE_E_FAILED: the record is given up to the end of the run, and log.context has the message
 * of a failure. */
kempe_status kmp_record_run(const kempe_system *system, const kmp_run_spec *spec, const kempe_assembly *start, int rows,
                            kmp_record *record);

/** Runs a run of a comparison again until t_end. KEMPE_STOPPED when interrupted: the rows until then. */
kempe_status kmp_record_make(const kempe_comparison *comparison, int run, double t_end, kmp_record *record);

/** The mechanism without a run, as far as it can be assembled: one row, of which only positions count. */
kempe_status kmp_record_start(const kempe_system *system, kmp_record *record);
void kmp_record_free(kmp_record *record);

/** Puts the residuals, the energy, the steps and the log of a record with rows as one JSON object. */
void kmp_record_put(kmp_json *json, const kmp_record *record);
