/* SPDX-License-Identifier: BSD-3-Clause */
/* Derivatives, and instances of ensembles, beside runs of models with other values of parameters. */
#pragma once

#include "analyses/sensitivity/sensitivity_study.h"
#include "ways.h"
#include <kempe/ensemble.h>
#include <kempe/table.h>
#include <math.h>
#include <stdio.h>

/** An output in the last row of a run. */
static inline double at_end(const kempe_trajectory *run, const char *output)
{
    kempe_table *table = NULL;
    CHECK(run && kempe_trajectory_outputs(run, output, &table) == KEMPE_OK);
    const double x = table ? kempe_table_number(table, kempe_table_row_count(table) - 1, 1) : NAN;
    kempe_table_free(table);
    return x;
}

/** A model given as text, with values of `count` parameters. */
static inline loaded load_text_set(const char *text, int count, const char *const *names, const double *values)
{
    char value[4][32];
    kempe_setting set[4];
    for (int i = 0; i < count; i++) {
        (void)snprintf(value[i], sizeof value[i], "%.17g", values[i]);
        set[i] = (kempe_setting){names[i], value[i]};
    }
    loaded l = {.context = kempe_context_new()};
    (void)kempe_model_read_text_set(l.context, text, "model.yaml", set, count, &l.model);
    return load_finish(l);
}

/** Derivatives of outputs at the end of a run of `text` by parameter p, as differences of two runs. */
static inline void slopes_of_runs(const kempe_sensitivity *s, int p, const char *text, double t_end, int count,
                                  const char *const *outputs, double *slope)
{
    const char *const name = s->name[p];
    memset(slope, 0, (size_t)count * sizeof *slope);
    for (int side = -1; side < 2; side += 2) {
        const double value = s->parameter[p] * (1 + side * 1e-4);
        loaded l = load_text_set(text, 1, &name, &value);
        kempe_trajectory *run = simulate(&l, &ways[4], t_end);
        for (int o = 0; o < count; o++)
            slope[o] += side * at_end(run, outputs[o]) / (2e-4 * s->parameter[p]);
        kempe_trajectory_free(run);
        unload(&l);
    }
}

/** The same derivative in the last row of a sensitivity. */
static inline double last_slope(const kempe_sensitivity *s, int p, int o)
{
    return s->cell[(s->rows - 1) * s->columns * (1 + s->count) + s->columns + o * s->count + p];
}

/** Five instances of an ensemble, lanes of one program together, are runs of models with these numbers. values: 5 x 2;
 * coordinates: the first ones, which are compared. */
static inline void instances_are_runs_of(const char *text, const char *const names[2], const double values[10],
                                         int coordinates)
{
    loaded l = load_text(text);
    const kempe_run_options options = {.t_end = 0.3, .rtol = 1e-10};
    kempe_values *set = NULL;
    kempe_ensemble *e = NULL;
    kempe_ensemble_result *batch = NULL;
    CHECK(l.model && kempe_values_new(l.model, 2, names, 5, values, &set) == KEMPE_OK &&
          kempe_ensemble_new(l.model, set, &e) == KEMPE_OK && kempe_ensemble_run(e, &options, 0, &batch) == KEMPE_OK);
    for (int k = 0; k < 5 && batch; k++) {
        loaded one = load_text_set(text, 2, names, values + 2 * k);
        kempe_trajectory *run = simulate(&one, &ways[4], 0.3);
        for (int i = 0; i < coordinates; i++)
            CHECK_NEAR(kempe_ensemble_result_q(batch, k)[i], last_q(run)[i], 1e-7);
        kempe_trajectory_free(run);
        unload(&one);
    }
    kempe_ensemble_result_free(batch);
    kempe_ensemble_free(e);
    kempe_values_free(set);
    unload(&l);
}
