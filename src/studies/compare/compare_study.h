/* SPDX-License-Identifier: BSD-3-Clause */
/* Many methods and tolerances on one scene, judged against one reference. */
#pragma once

#include "integrators/run/run.h"
#include "output/print.h"
#include "output/reference.h"
#include "output/verdict.h"
#include "studies/compare/compare_bodies.h"
#include <kempe/check.h>
#include <kempe/compare.h>

/** One method at one tolerance. Unknown values (of a failed run) are NaN. */
typedef struct kmp_compared {
    const kmp_method *method;
    double rtol;
    kempe_status status;
    const char *reason; /* "" when ok */
    kmp_verdict verdict;
    kmp_run_report report; /* its reason has moved to `reason` */
    double cpu_s;          /* of the integration: the least of the repeats */
    double build_s;        /* of the run's own preparation, likewise */
    double apart;          /* the difference of q from the run at the next tighter tolerance */
    bool left_out;         /* not run, or stopped, for lack of time: the reason explains it */
} kmp_compared;

/** Cost of a method for an error of q. NaN: it does not attain the error. */
typedef struct kmp_method_cost {
    double cpu_s, steps, rhs;
} kmp_method_cost;

enum { KMP_MOST_LEVELS = 9, KMP_MOST_AIMS = 2 };

/** The cost of each method for an error of q: the table at equal error. A run counts for a level when it and all
 * complete runs of its method at tighter tolerances are within it. Runs are indices into `runs`. */
typedef struct kmp_levels {
    int count;                     /* 0: there is no reference */
    double level[KMP_MOST_LEVELS]; /* descending */
    bool blank[KMP_MOST_LEVELS];   /* below ten times the reference's uncertainty: no statement is possible */
    int best[KMP_MOST_LEVELS];     /* the run of the cheapest method, -1: none */
    int *run;                      /* way_count x count: the cheapest of the method, -1: none, or blank */
    kmp_method_cost *cost;         /* likewise: between that run and the next coarser one, at the level itself */
} kmp_levels;

/** Error levels that the tables and the advice are for, coarse first. */
typedef struct kmp_error_levels {
    int count, level[KMP_MOST_AIMS];
} kmp_error_levels;

/** The two tables: methods with integrators that run on more than one formulation, methods of a family together; and
 * the best method of each formulation. */
typedef struct kmp_tables {
    kmp_error_levels aims;
    int same_count, *same;
    int best_count, *best;
} kmp_tables;

/** In an arena, which records missing memory. */
typedef struct kmp_sentences {
    int count;
    const char **s;
} kmp_sentences;

/** The recommended method, with reasons. */
typedef struct kmp_advice {
    int run;      /* index into `runs`; -1: nothing can be advised */
    double level; /* the error of q that it is for; NaN where errors are unknown */
    bool stiff;   /* explicit steps follow the fastest decay, not the motion */
    kmp_sentences because;
} kmp_advice;

enum { KMP_MOST_SOURCES = 4 };

/** One of the runs for Kempe's own reference. */
typedef struct kmp_source {
    kmp_method method;
    double rtol;
    double own;      /* the difference of q at a tenfold tolerance */
    double distance; /* of q from the reference; 0 for the reference itself */
} kmp_source;

struct kempe_comparison {
    const kempe_system *system;
    kmp_arena arena; /* of all below */
    kempe_status status;
    const char *reason;                      /* "" when ok */
    const struct kmp_start_balance *balance; /* at which all runs begin; NULL: at none */
    const char *source;                      /* description of the reference */
    bool has_reference;
    double uncertainty[KMP_QUANTITIES]; /* of the reference; 0 for a given one, NaN when unknown */
    int source_count;                   /* of an own reference */
    kmp_source sources[KMP_MOST_SOURCES];
    int instants;         /* at which errors are judged, of the whole time; 0: there is no reference */
    kmp_scales scales;    /* of the errors */
    bool *shared;         /* m: multipliers that redundant rows leave open, which are not judged */
    double amplification; /* of a small change of the start, at worst, in q; NaN when unknown */
    double until;         /* errors are judged up to this time */
    double t_end, budget_s;
    int method_count, rtol_count;
    kmp_method *methods; /* those run */
    double *rtols;
    int count;
    kmp_compared *runs; /* by method, then by tolerance in the order of the request: rtol_count each */
    kmp_levels levels;
    kmp_tables tables;
    kmp_advice advice;
    kmp_sentences failures; /* incomplete runs, in groups, with the reason */
    kmp_sentences warnings; /* of the reference, and of complete runs */
    kmp_bodies_table bodies;
};

/** Working data of a comparison. */
typedef struct kmp_compare_job {
    kempe_comparison *comparison;
    kempe_context *context;
    kempe_assembly *start;
    kmp_evaluator *eval;
    kmp_reference reference;
    kmp_times times; /* of judged rows */
    kmp_times few;   /* of rows in timed runs */
    double left_s;   /* of the processor, for the remaining runs */
    bool quiet;      /* messages of runs have been reported: the first run speaks for all */
} kmp_compare_job;

/** Results of explicit steps at two tolerances and of implicit ones at the coarser. */
typedef struct kmp_stiffness {
    int loose, tight, implicit; /* runs; -1: none with a result */
    bool stiff;
} kmp_stiffness;

bool kmp_is_implicit(const kmp_method *method);

/** The work of kempe_comparison_new. */
kempe_status kmp_compare(const kempe_system *system, const kempe_compare_options *options,
                         kempe_comparison **comparison);
