/* SPDX-License-Identifier: BSD-3-Clause */
#include "ensemble/optimize/objective.h"
#include "analyses/sensitivity/sensitivity_trajectory.h"
#include "base/clock.h"
#include "base/memory.h"
#include "ensemble/batch.h"
#include "model/data/model.h"
#include "output/print.h"
#include <math.h>
#include <string.h>

/* Of a trial, unless the caller gives another number: near a change point runs become as long as one likes. */
enum { MOST_STEPS = 10000 };

/* -- slopes ------------------------------------------------------------------------------------------ */

static bool has_slope(kmp_run_quantity_kind kind)
{
    return kind == KMP_TAKE_END || kind == KMP_TAKE_AT || kind == KMP_TAKE_MAX || kind == KMP_TAKE_MIN;
}

/* The column of a channel among those of the rows; -1: there is none. */
static int column_of(const kmp_objective *o, int channel)
{
    const kempe_sensitivity *rows = kmp_slope_runs_rows(o->runs);
    int n = rows->system->n, shown = o->list->run.shown[channel];
    int quantity = shown >= 0 ? KMP_QUANTITIES : (-1 - shown) / n, index = shown >= 0 ? shown : (-1 - shown) % n;
    for (int c = 0; c < rows->columns; c++) {
        const kmp_column *of = &rows->outputs.of[rows->chosen[c]];
        if ((int)of->quantity == quantity && of->index == index)
            return c;
    }
    return -1;
}

/* Why there are no slopes; KEMPE_OK with obstacle. */
static kempe_status refuse_slopes(kmp_objective *o, const char *reason)
{
    kmp_slope_runs_free(o->runs);
    o->runs = NULL;
    o->obstacle = kmp_arena_strdup(&o->arena, reason);
    kmp_context_clear(o->context);
    return kmp_made(o->context, o->obstacle);
}

/* A copy of the model whose outputs are those of the channels and all coordinates, rates, accelerations and states. */
static kempe_status add_rows(kmp_objective *o)
{
    KMP_TRY(kmp_variant_new(kmp_variant_model(o->list->variant), 0, NULL, &o->shown));
    static const kmp_output_kind rows[] = {KMP_OUTPUT_Q, KMP_OUTPUT_QD, KMP_OUTPUT_QDD, KMP_OUTPUT_STATE};
    kempe_model *m = kmp_variant_model(o->shown);
    int count = m->output_count - o->list->argument_outputs, more = m->state_count > 0 ? 4 : 3;
    kmp_output *outputs = KMP_ARENA_NEW(&m->arena, kmp_output, count + more);
    KMP_TRY(kmp_made(o->context, outputs));
    if (count > 0)
        memcpy(outputs, m->outputs, (size_t)count * sizeof *outputs);
    for (int k = 0; k < more; k++)
        outputs[count + k] = (kmp_output){.kind = rows[k], .index = -1};
    m->outputs = outputs;
    m->output_count = count + more;
    return KEMPE_OK;
}

static kempe_status derive_slopes(kmp_objective *o, const char *const *names, double t_end)
{
    const kmp_run_quantities *run = &o->list->run;
    kmp_text list = {0};
    for (int q = 0; q < run->count; q++) {
        if (!has_slope(run->of[q].kind))
            return refuse_slopes(o, kmp_arena_printf(&o->arena,
                                                     "'%s' has no exact derivative: at(..), max(..), min(..) "
                                                     "and values at the end have one",
                                                     o->list->name[run->of[q].first_value]));
    }
    for (int k = 0; k < o->count; k++)
        kmp_text_printf(&list, "%s%s", k ? "," : "", names[k]);
    for (int q = 0; q <= run->count; q++)
        o->times[q] = t_end * (q + 1) / (run->count + 1);
    const kempe_sensitivity_options ask = {.parameters = list.s, .run = &o->run};
    kempe_status status = list.failed ? kmp_fail_memory(o->context) : add_rows(o);
    if (status == KEMPE_OK)
        status = kmp_slope_runs_new(kmp_variant_model(o->shown), &ask, run->count + 1, o->times, false, &o->runs);
    kmp_text_free(&list);
    if (status != KEMPE_OK && status != KEMPE_E_MEMORY)
        return refuse_slopes(o, kempe_context_message(o->context));
    for (int k = 0; k < run->channels - run->arguments && status == KEMPE_OK; k++) {
        o->column[k] = column_of(o, k);
        if (o->column[k] < 0)
            return refuse_slopes(o, "an expression has no derivative");
    }
    return status;
}

/* The distinct ones in order, with the end; their number. */
static int order_times(kmp_objective *o, double t_end)
{
    int count = 0;
    for (int q = 0; q <= o->list->run.count; q++) {
        double t = q < o->list->run.count ? o->time[q] : t_end;
        int at = count;
        while (at > 0 && o->times[at - 1] >= t)
            at--;
        if (at < count && !(o->times[at] > t))
            continue;
        memmove(o->times + at + 1, o->times + at, (size_t)(count - at) * sizeof *o->times);
        o->times[at] = t;
        count++;
    }
    return count;
}

static void take_slopes(const kmp_objective *o, double *values, double *slopes)
{
    const kempe_sensitivity *rows = kmp_slope_runs_rows(o->runs);
    for (int q = 0; q < o->list->run.count; q++) {
        const kmp_run_quantity *of = &o->list->run.of[q];
        int row = 0, at = of->first_value, column = o->column[of->channel];
        while (row + 1 < rows->rows && rows->at[row] < o->time[q])
            row++;
        values[at] = kmp_sensitivity_value(rows, row, column);
        for (int k = 0; k < o->count; k++)
            slopes[(ptrdiff_t)at * o->count + k] = kmp_sensitivity_slope(rows, row, column, k);
    }
}

static kempe_status keep_refusal(kmp_objective *o, const char *reason)
{
    kmp_free(o->refusal);
    o->refusal = kmp_strdup(reason);
    kmp_context_clear(o->context);
    return kmp_made(o->context, o->refusal);
}

/* The run alone comes first: it finds the times of extremes, and it ends soon where the model does not run, while
 * derivatives grow without bound toward a dead centre. */
kempe_status kmp_objective_slopes(kmp_objective *objective, const double *x, double *values, double *slopes)
{
    kmp_objective *o = objective;
    const kempe_sensitivity *rows = kmp_slope_runs_rows(o->runs);
    KMP_TRY(kmp_objective_values(o, 1, x, o->row));
    memcpy(values, o->row, (size_t)o->list->run.values * sizeof *values);
    if (isnan(values[0]))
        return KEMPE_OK;
    /* The time of each quantity, by its kind; extremes at the times that a run found. */
    double t_end = rows->t_end;
    const kmp_run_quantities *run = &o->list->run;
    for (int q = 0; q < run->count; q++) {
        const kmp_run_quantity *of = &run->of[q];
        double at = of->kind == KMP_TAKE_AT ? of->time : of->kind == KMP_TAKE_END ? t_end : o->row[of->first_value + 1];
        o->time[q] = fmin(fmax(at, 0), t_end);
    }
    kmp_slope_runs_set_times(o->runs, order_times(o, rows->t_end), o->times);
    kempe_status status = kmp_slope_runs_at(o->runs, x);
    o->simulations++;
    if (status == KEMPE_OK)
        take_slopes(o, values, slopes);
    if (status != KEMPE_E_FAILED)
        return status;
    values[0] = NAN;
    return keep_refusal(o, kempe_context_message(o->context));
}

/* -- values ------------------------------------------------------------------------------------------ */

kempe_status kmp_objective_values(kmp_objective *objective, int rows, const double *x, double *values)
{
    kmp_objective *o = objective;
    kempe_ensemble_result *batch = NULL;
    int width = o->list->run.values;
    kempe_run_options run = o->run;
    double begin = kmp_cpu_now();
    run.threads = rows > 1 ? o->threads : 1;
    kempe_status status = kempe_ensemble_run_rows(o->ensemble, &run, 0, rows, x, &batch);
    if (batch)
        o->helped_s += fmax(0, kmp_batch_cpu(batch) - (kmp_cpu_now() - begin));
    o->simulations += rows;
    if (status == KEMPE_E_FAILED && batch)
        status = KEMPE_OK; /* each row has its reason */
    for (int k = 0; k < rows && status == KEMPE_OK; k++) {
        bool ok = kmp_word_is_complete(kempe_ensemble_result_status(batch, k));
        for (int i = 0; i < width; i++)
            values[(ptrdiff_t)k * width + i] = ok ? kempe_ensemble_result_quantity(batch, k, i) : NAN;
        if (!ok)
            status = keep_refusal(o, kempe_ensemble_result_reason(batch, k));
    }
    kempe_ensemble_result_free(batch);
    return status;
}

kempe_status kmp_objective_coarser(kmp_objective *objective, double factor, const double *x, double *values)
{
    const kempe_run_options run = objective->run;
    objective->run.rtol = factor * objective->rtol;
    kempe_status status = kmp_objective_values(objective, 1, x, values);
    objective->run = run;
    return status;
}

/* -- construction ------------------------------------------------------------------------------------ */

static kempe_status derive(kmp_objective *o, const kempe_model *model, const char *const *names, const char *quantity,
                           const char *limits)
{
    const kempe_ensemble_options ask = {.quantities = quantity, .limits = limits};
    KMP_TRY(kempe_values_new(model, o->count, names, 0, NULL, &o->values));
    KMP_TRY(kempe_ensemble_new_with(model, o->values, &ask, &o->ensemble));
    o->list = kmp_ensemble_quantities(o->ensemble);
    int quantities = o->list->run.count;
    KMP_TRY(kmp_made(o->context, KMP_ARENA_MAKE(&o->arena, KMP_ROOM(int, o->list->run.channels, &o->column),
                                                KMP_ROOM(double, quantities + 1, &o->time, &o->times),
                                                KMP_ROOM(double, o->list->run.values, &o->row))));
    kmp_run_spec spec;
    KMP_TRY(kmp_spec_of(kmp_ensemble_equations(o->ensemble), &o->run, &o->arena, &spec));
    o->rtol = spec.rtol;
    o->threads = o->run.threads;
    o->run.threads = 1;
    if (o->list->last_time > spec.t_end)
        return kmp_fail(o->context, KEMPE_E_ARGUMENT, "a quantity is taken at t = %g s, after the end of the run, %g s",
                        o->list->last_time, spec.t_end);
    return derive_slopes(o, names, spec.t_end);
}

kempe_status kmp_objective_init(kmp_objective *objective, const kempe_model *model, int count, const char *const *names,
                                const char *quantity, const char *limits, const kempe_run_options *run)
{
    *objective = (kmp_objective){.context = model->context, .count = count};
    KMP_OPTIONS(model->context, kempe_run_options, run);
    objective->run = *run;
    objective->run.no_convergence_check = 1;
    objective->run.max_steps = run->max_steps ? run->max_steps : MOST_STEPS;
    kempe_status status = derive(objective, model, names, quantity, limits);
    if (status != KEMPE_OK)
        kmp_objective_free(objective);
    return status;
}

KMP_CLEARS(kmp_objective, objective, kmp_slope_runs_free(objective->runs), kmp_variant_free(objective->shown),
           kempe_ensemble_free(objective->ensemble), kempe_values_free(objective->values), kmp_free(objective->refusal),
           kmp_arena_free(&objective->arena))
