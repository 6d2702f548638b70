/* SPDX-License-Identifier: BSD-3-Clause */
/* Quantities of runs (ensemble/quantity_words.h) as functions of parameters, with exact slopes where they
 * exist: of values at a time, and of extremes. The derivative of an extreme is that of its expression at its time,
 * because either the expression's rate is zero there, or the time is an end of the run. */
#pragma once

#include "analyses/sensitivity/sensitivity_study.h"
#include "ensemble/quantity_words.h"
#include <kempe/ensemble.h>

typedef struct kmp_objective {
    kempe_context *context;
    kmp_arena arena;
    kempe_values *values;
    kempe_ensemble *ensemble;
    const kmp_quantity_list *list; /* of the ensemble: the first value is the objective, others are those of limits */
    int count, *column;            /* parameters; of each channel among the columns of the rows */
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

/** The values at `rows` places (rows x count) into rows x values; NaN where the model does not run, refusal has a
 * reason. KEMPE_STOPPED: an interrupt. */
kempe_status kmp_objective_values(kmp_objective *objective, int rows, const double *x, double *values);

/** The same at one place with slopes, values x count, row-major. */
kempe_status kmp_objective_slopes(kmp_objective *objective, const double *x, double *values, double *slopes);

/** The values at one place by runs at `factor` times the tolerance; NaN where the model does not run. */
kempe_status kmp_objective_coarser(kmp_objective *objective, double factor, const double *x, double *values);
