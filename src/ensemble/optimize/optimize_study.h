/* SPDX-License-Identifier: BSD-3-Clause */
/* Parameters for which a quantity is least: searches, their result, its text and tables. */
#pragma once

#include "analyses/sensitivity/sensitivity_study.h"
#include "ensemble/fit/bounded.h"
#include "ensemble/optimize/constrained_minimum.h"
#include "ensemble/quantity_words.h"
#include <kempe/ensemble.h>
#include <kempe/optimize.h>

/* Quantities of runs (ensemble/quantity_words.h) as functions of parameters, with exact slopes where they
 * exist: of values at a time, of extremes, and of means and integrals over time. The derivative of an extreme is the
 * derivative of its expression at its time, because either the expression's rate is zero there, or the time is an end
 * of the run. An integral over time is a state of the model of these runs. */

typedef struct kmp_objective {
    kempe_context *context;
    kmp_arena arena;
    kempe_values *values;
    kempe_ensemble *ensemble;
    const kmp_quantity_list *list; /* of the ensemble: the first value is the objective, others are values of limits */
    int count, *column;            /* parameters; of each quantity among the columns of the rows */
    kempe_run_options run;         /* of one thread */
    int threads;                   /* that share the rows of several values */
    double rtol;                   /* of the runs */
    kmp_slope_runs *runs;          /* NULL: there are no slopes */
    kmp_variant *shown;            /* the model of these runs */
    char *obstacle;                /* the reason; NULL: there are slopes */
    double *time, *times;          /* of each quantity; of the rows */
    double *row;                   /* values of a batch */
    long simulations;
    double helped_s; /* processor time of other threads */
    char *refusal;   /* of the last values that do not run */
} kmp_objective;

/** Derives the equations. The threads of `run` share rows. `run` and the names must outlive it. Errors of
 * kempe_ensemble_new_with. */
kempe_status kmp_objective_init(kmp_objective *objective, const kempe_model *model, int count, const char *const *names,
                                const char *quantity, const char *limits, const kempe_run_options *run);
void kmp_objective_free(kmp_objective *objective);

/** The values (NaN where the model does not run, refusal has a reason) and slopes at one place, values x count,
 * row-major. KEMPE_STOPPED: an interrupt. */
kempe_status kmp_objective_slopes(kmp_objective *objective, const double *x, double *values, double *slopes);

/** An evaluation: NaN where the model did not run. */
typedef struct kmp_trial {
    double value, broken;
} kmp_trial;

/** One search. */
typedef struct kmp_searched {
    int number; /* of its start */
    bool begun;
    double *x; /* its start, then the best place */
    double value, broken;
    int evaluations, refused;
    kmp_squares_outcome outcome;
    kmp_trial *tried;
    int tried_count;
    char *refusal; /* of the last trial at which the model did not run; NULL: there is none */
} kmp_searched;

struct kempe_optimum {
    kempe_context *context;
    const kempe_model *model;
    kmp_arena arena;
    kmp_box_bounds bounded;
    kmp_objective objective;
    kmp_variant *variant; /* of the optimum, for its page */
    bool most_wanted;     /* the largest value */
    bool free_method;     /* slopes where they exist */
    const char *quantity, *limit_words, *method;
    int count, limits, starts, pool, most, refused, evaluations;
    double tolerance;
    double *start, *value;
    double *values, *at_best; /* of all quantities: at a hundredfold tolerance, and at the optimum */
    double coarser; /* change of the quantity there at a hundredfold tolerance; NaN: the model does not run with it */
    int threads, searches;
    kmp_searched *search;
    int best; /* search; -1: none */
    double seconds;
    kempe_status status;
    char *reason, *warnings;
};
