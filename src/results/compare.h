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

enum { KMP_MOST_LEVELS = 9 };

/** What each way needs for an error of q: the table at equal error. A run counts for a level when it and all runs of
 * its way at tighter tolerances that came to their end are within it. Runs are indices into `runs`. */
typedef struct kmp_levels {
    int count;                     /* 0: there is no reference to tell */
    double level[KMP_MOST_LEVELS]; /* descending */
    bool blank[KMP_MOST_LEVELS];   /* below ten times the reference's uncertainty: nothing can be said */
    int best[KMP_MOST_LEVELS];     /* the cheapest run of all that counts, -1: none */
    int *run;                      /* way_count x count: the cheapest of the way, -1: none, or blank */
} kmp_levels;

typedef struct kmp_sentences {
    int count;
    char **s;
} kmp_sentences;

/** Which way to take, and why. */
typedef struct kmp_advice {
    int run;      /* index into `runs`; -1: nothing can be advised */
    double level; /* the error of q that it is for; NaN where errors are not known */
    bool stiff;   /* explicit steps follow the fastest decay, not the motion */
    kmp_sentences because;
} kmp_advice;

struct kempe_comparison {
    const kempe_system *system;
    kempe_status status;
    char *reason; /* "" when ok */
    char *source; /* what the reference is */
    bool has_reference;
    double uncertainty[KMP_QUANTITIES]; /* of the reference; 0 for a given one, NaN when not known */
    double t_end;
    int way_count, rtol_count;
    kmp_way *ways; /* those run, taken over from the choice */
    int count;
    kmp_compared *runs; /* by way, then by tolerance as asked: rtol_count each, but for the last when interrupted */
    kmp_levels levels;
    kmp_advice advice;
    kmp_sentences failures; /* runs that did not come to their end, in groups, with the reason */
    kmp_sentences warnings; /* of runs that did */
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

/** Fills `levels` and `advice` from the runs. KEMPE_E_MEMORY. */
kempe_status kmp_compare_levels(kempe_comparison *comparison);
kempe_status kmp_compare_advise(kempe_comparison *comparison);

/** "reduced carried dop853"; in a table the form of a road that has none is "-". */
void kmp_compare_name(kmp_text *text, const kmp_way *way);

/** Adds one; false: no memory. */
bool kmp_sentences_add(kmp_sentences *list, const char *format, ...) __attribute__((format(printf, 2, 3)));
void kmp_sentences_free(kmp_sentences *list);

/** True when an error is too near to the reference's own uncertainty to say anything: below ten times it. */
bool kmp_compared_is_below(const kempe_comparison *comparison, const kmp_compared *run, kmp_quantity quantity);

#endif
