/* SPDX-License-Identifier: BSD-3-Clause */
/* Many ways and tolerances on one scene, judged against one reference. */
#ifndef KMP_RESULTS_COMPARE_H
#define KMP_RESULTS_COMPARE_H

#include "integrators/run.h"
#include "results/verdict.h"

/** One way at one tolerance. What is not known (a failed run) is NaN. */
typedef struct kmp_compared {
    const kmp_way *way;
    double rtol;
    kempe_status status;
    char *reason; /* "" when ok */
    kmp_verdict verdict;
    kmp_run_report report;
    double cpu_s; /* median of the repeats */
} kmp_compared;

/** Which ways and tolerances. */
typedef struct kmp_choice {
    int way_count;
    kmp_way *ways;
    int rtol_count;
    double *rtols;
} kmp_choice;

struct kempe_comparison {
    const kempe_system *system;
    kempe_status status;
    char *reason; /* "" when ok */
    char *source; /* what the reference is */
    bool has_reference;
    double uncertainty[KMP_QUANTITIES]; /* of the reference; 0 for a given one, NaN when not known */
    double t_end;
    kmp_way *ways; /* those run, taken over from the choice */
    int count;
    kmp_compared *runs; /* by way, then by tolerance as asked */
};

/** Reads the lists of the options. KEMPE_E_ARGUMENT: which name is unknown, and what there is. */
kempe_status kmp_choice_init(kmp_choice *choice, kempe_context *context, const kempe_compare_run *options);
void kmp_choice_free(kmp_choice *choice);

/** Runs a way once; `table` receives the rows, `verdict` is left alone. The caller frees report->reason. */
kempe_status kmp_compare_once(const kempe_system *system, const kmp_way *way, double rtol, double t_end, int time_count,
                              const double *times, const kempe_assembly *start, kmp_samples *table,
                              kmp_run_report *report);

/** Makes the comparison's own reference from two roads, and says so in `source`. Without one, has_reference stays
 * false. */
kempe_status kmp_compare_own_reference(kempe_comparison *comparison, const kempe_assembly *start, kmp_plant *plant,
                                       kmp_reference *reference);

/** True when an error is too near to the reference's own uncertainty to say anything: below ten times it. */
bool kmp_compared_is_below(const kempe_comparison *comparison, const kmp_compared *run, kmp_quantity quantity);

#endif
