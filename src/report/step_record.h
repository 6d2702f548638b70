/* SPDX-License-Identifier: BSD-3-Clause */
/* A repeated run of a comparison, monitored step by step: its residuals and energy over time, the lengths of its steps,
 * its events. */
#ifndef KMP_REPORT_STEP_RECORD_H
#define KMP_REPORT_STEP_RECORD_H

#include "studies/compare/compare_study.h"
#include <kempe/compare.h>

enum { KMP_RECORD_ROWS = 600, KMP_RECORD_RANGES = 600 };

/** Consecutive steps, from `t` on: the shortest and the longest of them. */
typedef struct kmp_step_range {
    double t, least, most;
} kmp_step_range;

typedef struct kmp_record {
    kmp_arena arena; /* of the arrays */
    int run;         /* index into the comparison's runs */
    kmp_samples row; /* of KMP_RECORD_ROWS + 1 times from 0 to t_end, up to the end of the run */
    double *h;       /* per row: max |h|, max |J qd + h_t|, both scaled as in verdicts */
    double *hdot;
    double *energy; /* per row: (E - work - that of the first row) / size, as in verdicts */
    double *kinetic, *potential;
    kmp_step_range *ranges;
    int range_count;
    long each; /* steps a range, but for the last */
    kmp_run_log log;
} kmp_record;

/** Runs it again until t_end. KEMPE_STOPPED when interrupted: the rows until then. */
kempe_status kmp_record_make(const kempe_comparison *comparison, int run, double t_end, kmp_record *record);
void kmp_record_free(kmp_record *record);

#endif
