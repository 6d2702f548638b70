/* SPDX-License-Identifier: BSD-3-Clause */
/* Starts, searches and their best result. Parameters are coordinates of the unit cube between their bounds. Threads
 * share the searches: each has a separate objective, and a search depends only on its start, so that results have the
 * same bits with any number of threads. */
#include "ensemble/optimize/optimize_study.h"
#include "analyses/sensitivity/sensitivity_trajectory.h"
#include "base/memory.h"
#include "base/thread_pool.h"
#include "constraints/tolerances.h"
#include "ensemble/batch.h"
#include "ensemble/fit/search_threads.h"
#include "ensemble/sampling/sampling.h"
#include "model/data/model.h"
#include "model/data/output_table.h"
#include "model/language/expression_references.h"
#include "model/read/loads.h"
#include "output/print.h"
#include "platform/platform.h"
#include "studies/simulate/trajectory.h"
#include <math.h>
#include <stdlib.h>
#include <string.h>

/* Of a trial, unless the caller gives another number: near a change point runs become as long as one likes. */
enum { MOST_STEPS = 10000 };

/* Rows on each side of an extreme, at distances of this part of the run. */
enum { NEXT = 2, ROWS = 2 * NEXT + 1 };
static const double APART = 1e-5;
/* Slopes jump by more than this part of their size, and than this multiple of their change next to the jump. */
static const double JUMP = 1e-6, STEEP = 10;

/* -- slopes ------------------------------------------------------------------------------------------ */

static bool is_integral(const kmp_run_quantity *of)
{
    return of->kind == KMP_TAKE_MEAN || of->kind == KMP_TAKE_RMS || of->kind == KMP_TAKE_INTEGRAL;
}

/* A column among the columns of the rows; -1: there is none. */
static int find_column(const kempe_sensitivity *rows, int quantity, int index)
{
    for (int c = 0; c < rows->columns; c++) {
        const kmp_column *of = &rows->outputs.of[rows->chosen[c]];
        if ((int)of->quantity == quantity && of->index == index)
            return c;
    }
    return -1;
}

/* The column of quantity q, which is the `integral`-th one of the integrals, or none of them. */
static int column_of(const kmp_objective *o, int q, int integral)
{
    const kmp_run_quantity *of = &o->list->run.of[q];
    const kempe_model *given = kmp_variant_model(o->list->variant);
    const int shown = o->list->run.shown[of->channel], n = given->motion_count;
    const kempe_sensitivity *rows = kmp_slope_runs_rows(o->runs);
    if (is_integral(of))
        return find_column(rows, KMP_QUANTITY_QD, n + integral);
    return shown >= 0 ? find_column(rows, KMP_QUANTITIES, shown)
                      : find_column(rows, (-1 - shown) / n, (-1 - shown) % n);
}

/* The expression of a channel; NULL: it is an output that no expression is, or an acceleration, which is known only
 * after the rates of states. */
static const kmp_expr *expression_of(const kmp_objective *o, int channel, kmp_arena *arena)
{
    const kempe_model *m = kmp_variant_model(o->list->variant);
    const int shown = o->list->run.shown[channel], n = m->motion_count;
    if (shown < 0) {
        const kmp_quantity quantity = (kmp_quantity)((-1 - shown) / n);
        const kmp_expr e = {.kind = quantity == KMP_QUANTITY_Q ? KMP_EXPR_Q : KMP_EXPR_QD, .index = (-1 - shown) % n};
        return quantity == KMP_QUANTITY_Q || quantity == KMP_QUANTITY_QD ? kmp_expr_make(arena, e) : NULL;
    }
    for (int k = 0, at = 0; k < m->output_count; at += kmp_output_width(m, &m->outputs[k++]))
        if (at == shown && m->outputs[k].kind == KMP_OUTPUT_SENSOR) {
            const kmp_expr *e = m->sensors[m->outputs[k].index].expr;
            return kmp_expr_acceleration(e) ? NULL : e;
        }
    return NULL;
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

/* The integrals of quantities over time as states: of the square for a root of the mean square. */
static kempe_status add_integrals(kmp_objective *o)
{
    const kmp_run_quantities *run = &o->list->run;
    kempe_model *m = kmp_variant_model(o->shown);
    const char **names = KMP_ARENA_NEW(&m->arena, const char *, run->count);
    const kmp_expr **rates = KMP_ARENA_NEW(&m->arena, const kmp_expr *, run->count);
    int count = 0;
    KMP_TRY(kmp_made(o->context, names && rates));
    for (int q = 0; q < run->count; q++) {
        if (!is_integral(&run->of[q]))
            continue;
        const kmp_expr *e = expression_of(o, run->of[q].channel, &m->arena);
        if (e && run->of[q].kind == KMP_TAKE_RMS)
            e = kmp_expr_make(&m->arena, (kmp_expr){.kind = KMP_EXPR_MUL, .a = e, .b = e});
        names[count] = kmp_arena_printf(&m->arena, "integral %d", count + 1);
        rates[count++] = e;
    }
    KMP_TRY(kmp_made(o->context, !m->arena.failed));
    return count > 0 ? kmp_variant_add_states(o->shown, count, names, rates) : KEMPE_OK;
}

/* A copy of the model whose outputs are the channels and all coordinates, rates, accelerations and states, integrals
 * among them. */
static kempe_status add_rows(kmp_objective *o)
{
    KMP_TRY(kmp_variant_new(kmp_variant_model(o->list->variant), 0, NULL, &o->shown));
    KMP_TRY(add_integrals(o));
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
        const kmp_run_quantity_kind kind = run->of[q].kind;
        const char *name = o->list->name[run->of[q].first_value];
        if (is_integral(&run->of[q]) && !expression_of(o, run->of[q].channel, &o->arena))
            return refuse_slopes(o, kmp_arena_printf(&o->arena,
                                                     "'%s' has no exact derivative: integrals over time have one of "
                                                     "expressions without accelerations",
                                                     name));
        if (!is_integral(&run->of[q]) && kind != KMP_TAKE_END && kind != KMP_TAKE_AT && kind != KMP_TAKE_MAX &&
            kind != KMP_TAKE_MIN)
            return refuse_slopes(o, kmp_arena_printf(&o->arena,
                                                     "'%s' has no exact derivative: at(..), max(..), min(..), "
                                                     "mean(..), rms(..), integral(..) and values at the end have one",
                                                     name));
    }
    for (int k = 0; k < o->count; k++)
        kmp_text_printf(&list, "%s%s", k ? "," : "", names[k]);
    const int most = ROWS * run->count + 1;
    for (int k = 0; k < most; k++)
        o->times[k] = t_end * (k + 1) / most;
    const kempe_sensitivity_options ask = {.parameters = list.s, .run = &o->run};
    kempe_status status = list.failed ? kmp_fail_memory(o->context) : add_rows(o);
    if (status == KEMPE_OK)
        status = kmp_slope_runs_new(kmp_variant_model(o->shown), &ask, most, o->times, false, &o->runs);
    kmp_text_free(&list);
    if (status != KEMPE_OK && status != KEMPE_E_MEMORY)
        return refuse_slopes(o, kempe_context_message(o->context));
    for (int q = 0, integral = 0; q < run->count && status == KEMPE_OK; q++) {
        o->column[q] = column_of(o, q, integral);
        integral += is_integral(&run->of[q]);
        if (o->column[q] < 0)
            return refuse_slopes(o, "an expression has no derivative");
    }
    return status;
}

static bool is_extreme(const kmp_run_quantity *of)
{
    return of->kind == KMP_TAKE_MAX || of->kind == KMP_TAKE_MIN;
}

static double begin_of(const kmp_run_quantity *of)
{
    return of->spanned ? of->begin : 0;
}

static double end_of(const kmp_run_quantity *of, double t_end)
{
    return of->spanned ? fmin(of->end, t_end) : t_end;
}

/* The time of a row of quantity q, `place` rows after its own time; this time where it is not an extreme inside the
 * run. An integral has the row of its beginning in front. */
static double time_of(const kmp_objective *o, int q, int place, double t_end)
{
    if (is_integral(&o->list->run.of[q]) && place < 0 && begin_of(&o->list->run.of[q]) > 0)
        return begin_of(&o->list->run.of[q]);
    const double t = o->time[q], apart = NEXT * APART * t_end;
    const bool inside = is_extreme(&o->list->run.of[q]) && t > apart && t < t_end - apart;
    return inside ? t + place * APART * t_end : t;
}

/* The distinct ones in order, with the end; their number. */
static int order_times(kmp_objective *o, double t_end)
{
    int count = 0;
    for (int k = 0; k <= ROWS * o->list->run.count; k++) {
        double t = k < ROWS * o->list->run.count ? time_of(o, k / ROWS, k % ROWS - NEXT, t_end) : t_end;
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

static int row_at(const kempe_sensitivity *rows, double t)
{
    int row = 0;
    while (row + 1 < rows->rows && rows->at[row] < t)
        row++;
    return row;
}

/* True if the slope by parameter k jumps at the time of quantity q: an event has this time, which depends on the
 * parameter. Elsewhere the derivative by time is zero, or the time is given. */
static bool slope_jumps(const kmp_objective *o, const double *x, int q, int k)
{
    const kempe_sensitivity *rows = kmp_slope_runs_rows(o->runs);
    const int column = o->column[q];
    double slope[ROWS], size = 0, value = 0;
    for (int i = 0; i < ROWS; i++) {
        const int row = row_at(rows, time_of(o, q, i - NEXT, rows->t_end));
        slope[i] = kmp_sensitivity_slope(rows, row, column, k);
        value = fmax(value, fabs(kmp_sensitivity_value(rows, row, column)));
        size = fmax(size, fabs(slope[i]));
    }
    const double smooth = fabs(slope[NEXT - 1] - slope[0]) + fabs(slope[ROWS - 1] - slope[NEXT + 1]);
    const double jump = fabs(slope[NEXT + 1] - slope[NEXT - 1]);
    return jump > STEEP * smooth + JUMP * size && jump * fabs(x[k]) > JUMP * value;
}

/* The first extreme without an exact derivative; -1: none. */
static int find_corner(const kmp_objective *o, const double *x)
{
    for (int q = 0; q < o->list->run.count; q++)
        for (int k = 0; k < o->count && is_extreme(&o->list->run.of[q]); k++)
            if (slope_jumps(o, x, q, k))
                return q;
    return -1;
}

/* Makes an integral its quantity; the factor of the slopes. */
static double take_mean(const kmp_run_quantity *of, double t_end, double *value)
{
    const double length = end_of(of, t_end) - begin_of(of);
    if (of->kind == KMP_TAKE_INTEGRAL)
        return 1;
    *value /= length;
    if (of->kind == KMP_TAKE_MEAN)
        return 1 / length;
    *value = sqrt(fmax(*value, 0));
    return *value > 0 ? 1 / (2 * length * *value) : 0; /* least where it is zero */
}

static void take_slopes(const kmp_objective *o, double *values, double *slopes)
{
    const kempe_sensitivity *rows = kmp_slope_runs_rows(o->runs);
    for (int q = 0; q < o->list->run.count; q++) {
        const kmp_run_quantity *of = &o->list->run.of[q];
        const int at = of->first_value, column = o->column[q], row = row_at(rows, o->time[q]);
        const int before = is_integral(of) && begin_of(of) > 0 ? row_at(rows, begin_of(of)) : -1;
        values[at] =
            kmp_sensitivity_value(rows, row, column) - (before >= 0 ? kmp_sensitivity_value(rows, before, column) : 0);
        const double factor = is_integral(of) ? take_mean(of, rows->t_end, &values[at]) : 1;
        for (int k = 0; k < o->count; k++)
            slopes[(ptrdiff_t)at * o->count + k] =
                factor * (kmp_sensitivity_slope(rows, row, column, k) -
                          (before >= 0 ? kmp_sensitivity_slope(rows, before, column, k) : 0));
    }
}

static kempe_status keep_refusal(kmp_objective *o, const char *reason)
{
    kmp_free(o->refusal);
    o->refusal = kmp_strdup(reason);
    kmp_context_clear(o->context);
    return kmp_made(o->context, o->refusal);
}

/* The same of a run in which a quantity has no value, as at a time behind its end; `reason`: of that end, or empty. */
static kempe_status keep_absence(kmp_objective *o, int value, const char *reason)
{
    kmp_text text = {0};
    kmp_text_printf(&text, "'%s' has no value%s%s", o->list->name[value], *reason ? ": " : "", reason);
    const kempe_status status = text.failed ? KEMPE_E_MEMORY : keep_refusal(o, text.s);
    kmp_text_free(&text);
    return status;
}

/* The values at `rows` places (rows x count) into rows x values; NaN where the model does not run or a quantity has no
 * value, refusal has a reason. KEMPE_STOPPED: an interrupt. */
static kempe_status values_at(kmp_objective *objective, int rows, const double *x, double *values)
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
    if ((status == KEMPE_E_FAILED || kmp_is_complete(status)) && batch)
        status = KEMPE_OK; /* each row has its reason, the context what they are doubted for */
    for (int k = 0; k < rows && status == KEMPE_OK; k++) {
        bool ok = kmp_outcome_is_complete(kempe_ensemble_result_outcome(batch, k));
        for (int i = 0; i < width; i++)
            values[(ptrdiff_t)k * width + i] = ok ? kempe_ensemble_result_quantity(batch, k, i) : NAN;
        int absent = 0;
        while (ok && absent < width && !isnan(values[(ptrdiff_t)k * width + absent]))
            absent++;
        if (!ok)
            status = keep_refusal(o, kempe_ensemble_result_reason(batch, k));
        else if (absent < width)
            status = keep_absence(o, absent, kempe_ensemble_result_reason(batch, k));
    }
    kempe_ensemble_result_free(batch);
    return status;
}

kempe_status kmp_objective_slopes(kmp_objective *objective, const double *x, double *values, double *slopes)
{
    kmp_objective *o = objective;
    const kempe_sensitivity *rows = kmp_slope_runs_rows(o->runs);
    KMP_TRY(values_at(o, 1, x, o->row));
    memcpy(values, o->row, (size_t)o->list->run.values * sizeof *values);
    if (isnan(values[0]))
        return KEMPE_OK;
    /* The time of each quantity, by its kind; extremes at the times that a run found. */
    double t_end = rows->t_end;
    const kmp_run_quantities *run = &o->list->run;
    for (int q = 0; q < run->count; q++) {
        const kmp_run_quantity *of = &run->of[q];
        double at = of->kind == KMP_TAKE_AT    ? of->time
                    : of->kind == KMP_TAKE_END ? t_end
                    : is_integral(of)          ? end_of(of, t_end)
                                               : o->row[of->first_value + 1];
        o->time[q] = fmin(fmax(at, 0), t_end);
    }
    kmp_slope_runs_set_times(o->runs, order_times(o, rows->t_end), o->times);
    kempe_status status = kmp_slope_runs_at(o->runs, x);
    o->simulations++;
    const int corner = status == KEMPE_OK ? find_corner(o, x) : -1;
    if (corner >= 0) {
        kmp_text text = {0};
        kmp_text_printf(&text,
                        "'%s' is taken at an event at t = %.9g s, whose time depends on parameters: it has no exact "
                        "derivative there; use --method values",
                        o->list->name[run->of[corner].first_value], o->time[corner]);
        values[0] = NAN;
        status = text.failed ? KEMPE_E_MEMORY : keep_refusal(o, text.s);
        kmp_text_free(&text);
        return status;
    }
    if (status == KEMPE_OK)
        take_slopes(o, values, slopes);
    if (status != KEMPE_E_FAILED)
        return status;
    values[0] = NAN;
    return keep_refusal(o, kempe_context_message(o->context));
}

/* -- values ------------------------------------------------------------------------------------------ */

/* -- construction ------------------------------------------------------------------------------------ */

static kempe_status derive(kmp_objective *o, const kempe_model *model, const char *const *names, const char *quantity,
                           const char *limits)
{
    const kempe_ensemble_options ask = {.quantities = quantity, .limits = limits};
    KMP_TRY(kempe_values_new(model, o->count, names, 0, NULL, &o->values));
    KMP_TRY(kempe_ensemble_new_with(model, o->values, &ask, &o->ensemble));
    o->list = kmp_ensemble_quantities(o->ensemble);
    int quantities = o->list->run.count;
    if (o->list->requested != 1)
        return kmp_fail(o->context, KEMPE_E_ARGUMENT,
                        "'%s' has %d values, and one is minimized or maximized: name one joint, and give the others as "
                        "limits",
                        quantity, o->list->requested);
    KMP_TRY(kmp_made(o->context, KMP_ARENA_MAKE(&o->arena, KMP_ROOM(int, quantities, &o->column),
                                                KMP_ROOM(double, quantities + 1, &o->time),
                                                KMP_ROOM(double, ROWS *quantities + 1, &o->times),
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
    KMP_TRY(kmp_run_options_check(model->context, run, KMP_STUDY_OPTIMUM));
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

/* -- the study ---------------------------------------------------------------------------------------------- */

enum { MOST_EVALUATIONS = 500, POOL = 8, MOST_STARTS = 100000 };

/* The evaluator of one thread. The first one belongs to the caller and has its context. */
typedef struct searcher {
    kempe_optimum *o;
    kempe_context *context;
    kmp_variant *copy; /* the model, with this context */
    kmp_objective own, *objective;
    double *x, *values, *slopes; /* of a trial: in SI; of all quantities */
    kmp_searched *search;
    kempe_status status;
} searcher;

/* -- evaluations ------------------------------------------------------------------------------------- */

static double side(const kempe_optimum *o, int k)
{
    return o->bounded.upper[k] - o->bounded.lower[k];
}

/* From the unit cube to values between the bounds; they may be the same array. */
static void leave_cube(const kempe_optimum *optimum, const double *cube, double *x)
{
    const kmp_box_bounds *bounded = &optimum->bounded;
    for (int k = 0; k < optimum->count; k++)
        x[k] = fmin(fmax(bounded->lower[k] + side(optimum, k) * cube[k], bounded->lower[k]), bounded->upper[k]);
}

/* The largest part by which limits are not kept: over the bound, or over 1 where it is 0. */
static double broken_part(const kempe_optimum *optimum, const double *values, double *limit)
{
    const kmp_quantity_list *list = optimum->objective.list;
    double most = 0;
    for (int k = 0; k < list->limit_count; k++) {
        const kmp_quantity_limit *l = &list->limit[k];
        double over = kmp_limit_excess(l, values[l->value]);
        most = fmax(most, isnan(over) ? INFINITY : over);
        if (limit)
            limit[k] = over;
    }
    return most;
}

static void give_slopes(const searcher *w, double *slope, double *limit_slope)
{
    const kempe_optimum *o = w->o;
    const kmp_quantity_list *list = o->objective.list;
    double sign = o->most_wanted ? -1 : 1;
    for (int k = 0; k < o->count; k++)
        slope[k] = sign * w->slopes[k] * side(o, k);
    for (int l = 0; l < list->limit_count; l++) {
        const kmp_quantity_limit *limit = &list->limit[l];
        for (int k = 0; k < o->count; k++)
            limit_slope[l * o->count + k] =
                limit->sign * w->slopes[(ptrdiff_t)limit->value * o->count + k] * side(o, k) / kmp_limit_size(limit);
    }
}

static kmp_lm_message try(void *user, const double *cube, double *value, double *slope, double *limit,
                          double *limit_slope)
{
    searcher *w = user;
    const kempe_optimum *o = w->o;
    bool slopes = strcmp(o->method, "slopes") == 0;
    leave_cube(o, cube, w->x);
    kmp_progress(w->context, KMP_PROGRESS_STUDY, w->search->number, o->starts, "searches");
    w->status = slopes ? kmp_objective_slopes(w->objective, w->x, w->values, w->slopes)
                       : values_at(w->objective, 1, w->x, w->values);
    if (w->status != KEMPE_OK)
        return KMP_SQUARES_END;
    kmp_searched *s = w->search;
    kmp_trial *tried = kmp_list_room(s->tried, (size_t)s->tried_count, sizeof *tried);
    if (!tried) {
        w->status = kmp_fail_memory(w->context);
        return KMP_SQUARES_END;
    }
    s->tried = tried;
    tried[s->tried_count++] = (kmp_trial){w->values[0], broken_part(o, w->values, NULL)};
    if (isnan(w->values[0]))
        return KMP_SQUARES_NOWHERE;
    *value = o->most_wanted ? -w->values[0] : w->values[0];
    double broken = broken_part(o, w->values, limit);
    if (slopes)
        give_slopes(w, slope, limit_slope);
    return isfinite(broken) ? KMP_SQUARES_GO : KMP_SQUARES_NOWHERE;
}

/* -- one thread -------------------------------------------------------------------------------------- */

/* The caller's objective exists; another thread derives its equations again, in a separate context. */
static kempe_status begin_searcher(void *self, void *job, kempe_context *context, bool caller)
{
    searcher *w = self;
    kempe_optimum *o = job;
    const int width = o->objective.list->run.values;
    const char *const *names = (const char *const *)o->bounded.name;
    w->o = o;
    w->context = context;
    w->x = KMP_NEW(double, o->count);
    w->values = KMP_NEW(double, width);
    w->slopes = KMP_NEW(double, (ptrdiff_t)width * o->count);
    if (!w->x || !w->values || !w->slopes)
        return KEMPE_E_MEMORY;
    if (caller) {
        w->objective = &o->objective;
        return KEMPE_OK;
    }
    KMP_TRY(kmp_variant_new_in(w->context, o->model, 0, NULL, &w->copy));
    KMP_TRY(kmp_objective_init(&w->own, kmp_variant_model(w->copy), o->count, names, o->quantity, o->limit_words,
                               &o->objective.run));
    w->objective = &w->own;
    return KEMPE_OK;
}

static void end_searcher(void *self)
{
    searcher *w = self;
    if (w->objective == &w->own) {
        w->o->objective.simulations += w->own.simulations;
        kmp_objective_free(&w->own);
    }
    kmp_variant_free(w->copy);
    kmp_free(w->x);
    kmp_free(w->values);
    kmp_free(w->slopes);
}

static kempe_status search_from(void *self, int number)
{
    searcher *w = self;
    const kempe_optimum *o = w->o;
    kmp_searched *s = &w->o->search[number];
    const kmp_minimum minimum = {.count = o->count,
                                 .limits = o->limits,
                                 .slopes = strcmp(o->method, "slopes") == 0,
                                 .tolerance = o->tolerance,
                                 .kept = KMP_OPTIMUM_KEPT,
                                 .most = o->most,
                                 .at = try,
                                 .user = w};
    kmp_minimum_report report = {0};
    w->search = s;
    s->begun = true;
    if (!kmp_minimum_find(&minimum, s->x, &report))
        w->status = kmp_fail_memory(w->context);
    leave_cube(o, s->x, s->x);
    s->value = report.value;
    s->broken = report.broken;
    s->evaluations = report.evaluations;
    s->refused = report.refused + (report.outcome == KMP_SQUARES_NO_START);
    s->outcome = report.outcome;
    if (s->refused > 0 && w->objective->refusal && !(s->refusal = kmp_strdup(w->objective->refusal)))
        w->status = kmp_fail_memory(w->context);
    return w->status;
}

/* -- all searches ------------------------------------------------------------------------------------ */

static bool is_better(const kmp_searched *a, const kmp_searched *b)
{
    bool kept = a->broken <= KMP_OPTIMUM_KEPT, other = b->broken <= KMP_OPTIMUM_KEPT;
    return kept && other ? a->value < b->value : a->broken < b->broken;
}

/* Searches from the starts search[0] .. search[count - 1] by o->threads threads. Their x are the starts in the unit
 * cube, and then the best places in SI. Searches that have begun are kept, o->searches of them. KEMPE_STOPPED: an
 * interrupt; a search that was under way has its best place so far. */
static kempe_status run_searches(kempe_optimum *optimum, int count)
{
    static const kmp_searcher_kind kind = {sizeof(searcher), begin_searcher, search_from, end_searcher};
    kempe_optimum *o = optimum;
    kempe_status status = kmp_share_searches(o->context, &kind, o, o->threads, count, &o->seconds);
    /* Keeps the searches that have begun, in the order of their starts. */
    for (int k = 0; k < count; k++) {
        if (!o->search[k].begun)
            continue;
        const kmp_searched *s = &o->search[o->searches];
        o->search[o->searches] = o->search[k];
        o->evaluations += s->evaluations;
        o->refused += s->refused;
        if (s->outcome != KMP_SQUARES_NO_START && (o->best < 0 || is_better(s, &o->search[o->best])))
            o->best = o->searches;
        o->searches++;
    }
    return status;
}

/* -- starts ------------------------------------------------------------------------------------------ */

/* Places of the pool that run: the ones that keep the limits by their value, then the others. */
typedef struct place {
    int number;
    double value, broken;
} place;

static int order_places(const void *a, const void *b)
{
    const place *x = a, *y = b;
    if (x->broken != y->broken)
        return x->broken < y->broken ? -1 : 1;
    if (x->value != y->value)
        return x->value < y->value ? -1 : 1;
    return (x->number > y->number) - (x->number < y->number);
}

static void sobol_place(const kempe_optimum *o, int k, double *cube)
{
    for (int c = 0; c < o->count; c++)
        cube[c] = kmp_design_point(KMP_DESIGN_SOBOL, 1, (uint64_t)k, 0, c, o->count);
}

static kempe_status judge_pool(kempe_optimum *o, int count, place *places, double *x, double *values, int *running)
{
    int width = o->objective.list->run.values;
    for (int k = 0; k < count; k++) {
        double *row = x + (ptrdiff_t)k * o->count;
        sobol_place(o, k, row);
        leave_cube(o, row, row);
    }
    KMP_TRY(values_at(&o->objective, count, x, values));
    *running = 0;
    for (int k = 0; k < count; k++) {
        const double *row = values + (ptrdiff_t)k * width;
        double broken = broken_part(o, row, NULL);
        if (isfinite(row[0]) && isfinite(broken))
            places[(*running)++] = (place){k, o->most_wanted ? -row[0] : row[0], broken};
    }
    qsort(places, (size_t)*running, sizeof *places, order_places);
    return KEMPE_OK;
}

/* Cubes of all starts; their number: the pool may have fewer places that run. */
static kempe_status find_starts(kempe_optimum *o, double *cubes, int *found)
{
    int count = o->pool * (o->starts - 1), running = 0, width = o->objective.list->run.values;
    kmp_arena arena = {0};
    place *places = KMP_ARENA_NEW(&arena, place, count);
    double *x = KMP_ARENA_NEW(&arena, double, (ptrdiff_t)count * o->count);
    double *values = KMP_ARENA_NEW(&arena, double, (ptrdiff_t)count *width);
    for (int k = 0; k < o->count; k++)
        cubes[k] = (o->start[k] - o->bounded.lower[k]) / (o->bounded.upper[k] - o->bounded.lower[k]);
    kempe_status status = kmp_made(o->context, !arena.failed);
    if (status == KEMPE_OK && count > 0)
        status = judge_pool(o, count, places, x, values, &running);
    *found = 1;
    for (int k = 0; k < running && *found < o->starts && status == KEMPE_OK; k++, ++*found)
        sobol_place(o, places[k].number, cubes + (ptrdiff_t)*found * o->count);
    kmp_arena_free(&arena);
    return status;
}

/* -- the result --------------------------------------------------------------------------------------- */

enum { COARSER = 100 };

/* The quantities at the optimum, and their change with the tolerance of the runs. */
static kempe_status settle(kempe_optimum *o)
{
    if (o->best < 0)
        return kmp_fail(o->context, KEMPE_E_FAILED, "%s: %s",
                        o->starts > 1 ? "none of the starts gives a value" : "the start gives no value",
                        o->search[0].refusal ? o->search[0].refusal : "");
    memcpy(o->value, o->search[o->best].x, (size_t)o->count * sizeof *o->value);
    const kempe_run_options own = o->objective.run;
    o->objective.run.rtol = COARSER * o->objective.rtol;
    kempe_status coarser = values_at(&o->objective, 1, o->value, o->values);
    o->objective.run = own;
    KMP_TRY(coarser);
    const bool quiet = kmp_context_quiet(o->context, false); /* what its run is doubted for */
    kempe_status run = values_at(&o->objective, 1, o->value, o->at_best);
    (void)kmp_context_quiet(o->context, quiet);
    KMP_TRY(run);
    o->coarser = fabs(o->values[0] - o->at_best[0]);
    const char *const *names = (const char *const *)o->bounded.name;
    kmp_text why = {0};
    KMP_TRY(kmp_variant_new(o->model, o->count, names, &o->variant));
    kempe_status status = kmp_variant_set(o->variant, o->value, &why);
    kmp_text_free(&why);
    return status;
}

static void begin_searches(kempe_optimum *o, int count, double *x, const double *cubes)
{
    memcpy(x, cubes, (size_t)count * (size_t)o->count * sizeof *x);
    for (int k = 0; k < count; k++)
        o->search[k] = (kmp_searched){.number = k, .x = x + (ptrdiff_t)k * o->count};
}

/* No start has slopes, as where a condition ends the run: the reason, and searches without them. */
static kempe_status search_without_slopes(kempe_optimum *o, int count, double *x, const double *cubes)
{
    o->objective.obstacle = kmp_arena_strdup(&o->arena, o->search[0].refusal ? o->search[0].refusal : "");
    KMP_TRY(kmp_made(o->context, o->objective.obstacle));
    for (int k = 0; k < o->searches; k++) {
        kmp_free(o->search[k].tried);
        kmp_free(o->search[k].refusal);
    }
    o->searches = o->refused = o->evaluations = 0;
    o->method = "values";
    begin_searches(o, count, x, cubes);
    return run_searches(o, count);
}

static kempe_status search_all(kempe_optimum *o)
{
    int found = 0;
    double *cubes = KMP_ARENA_NEW(&o->arena, double, (ptrdiff_t)o->starts * o->count);
    double *x = KMP_ARENA_NEW(&o->arena, double, (ptrdiff_t)o->starts * o->count);
    o->search = KMP_ARENA_NEW(&o->arena, kmp_searched, o->starts);
    KMP_TRY(kmp_made(o->context, !o->arena.failed));
    KMP_TRY(find_starts(o, cubes, &found));
    begin_searches(o, found, x, cubes);
    kempe_status status = run_searches(o, found);
    if (status == KEMPE_OK && o->best < 0 && o->free_method && strcmp(o->method, "slopes") == 0)
        status = search_without_slopes(o, found, x, cubes);
    if (status == KEMPE_OK)
        return settle(o);
    if (status != KEMPE_STOPPED || o->best < 0)
        return status;
    kmp_model_begin_forces(o->model);
    KMP_TRY(settle(o));
    return kmp_fail(o->context, KEMPE_STOPPED, "interrupted after %d of %d searches: the best place so far is given",
                    o->searches, found);
}

/* -- options ----------------------------------------------------------------------------------------- */

static kempe_status prepare(kempe_optimum *o, const kempe_optimum_options *options)
{
    const char *quantity = options->minimize ? options->minimize : options->maximize;
    if (!kmp_minimum_available)
        return kmp_fail(o->context, KEMPE_E_FAILED,
                        "this build has no optimisation: install libnlopt-dev and build Kempe again");
    if (!options->minimize == !options->maximize)
        return kmp_fail(o->context, KEMPE_E_ARGUMENT, "either a quantity to minimise or one to maximise is expected");
    if (options->starts > MOST_STARTS || options->pool > MOST_STARTS)
        return kmp_fail(o->context, KEMPE_E_ARGUMENT, "at most %d starts, with a pool of %d each, are possible",
                        MOST_STARTS, MOST_STARTS);
    o->most_wanted = !options->minimize;
    o->starts = options->starts > 0 ? options->starts : 1;
    o->pool = options->pool > 0 ? options->pool : POOL;
    o->most = options->most > 0 ? options->most : MOST_EVALUATIONS;
    o->tolerance = options->tolerance > 0 ? options->tolerance : KMP_OPTIMUM_ENOUGH;
    KMP_TRY(kmp_box_bounds_read(o->model, options->parameters, &o->arena, &o->bounded));
    o->count = o->bounded.count;
    for (int k = 0; k < o->count; k++)
        if (!isfinite(o->bounded.upper[k] - o->bounded.lower[k]))
            return kmp_fail(o->context, KEMPE_E_ARGUMENT, "parameter '%s' needs two bounds, NAME:LOW:HIGH",
                            o->bounded.name[k]);
    KMP_TRY(o->count <= KMP_SOBOL_MOST
                ? KEMPE_OK
                : kmp_fail(o->context, KEMPE_E_ARGUMENT, "at most %d parameters are possible", (int)KMP_SOBOL_MOST));
    KMP_TRY(kmp_objective_init(&o->objective, o->model, o->count, (const char *const *)o->bounded.name, quantity,
                               options->limits, options->run));
    o->threads = o->objective.threads > 0 ? o->objective.threads : kmp_processors();
    int width = o->objective.list->run.values;
    o->limits = o->objective.list->limit_count;
    o->quantity = kmp_arena_strdup(&o->arena, quantity);
    o->limit_words = options->limits;
    KMP_TRY(kmp_made(o->context, KMP_ARENA_MAKE(&o->arena, KMP_ROOM(double, o->count, &o->start, &o->value),
                                                KMP_ROOM(double, width, &o->values, &o->at_best))));
    const char *file = options->start;
    kmp_variant *given = NULL;
    KMP_TRY(kmp_variant_new(o->model, o->count, (const char *const *)o->bounded.name, &given));
    for (int k = 0; k < o->count; k++) {
        const kempe_model *m = kmp_variant_model(given);
        o->start[k] = m->parameters[kmp_parameter_find(m, o->bounded.name[k])].number.value;
    }
    kmp_variant_free(given);
    if (file)
        KMP_TRY(kmp_box_bounds_read_start(o->context, file, &o->bounded, o->start));
    KMP_TRY(kmp_box_bounds_check(o->context, &o->bounded, o->start));
    const char *method = options->method;
    bool slopes = method ? strcmp(method, "slopes") == 0 : o->objective.runs != NULL;
    if (method && !slopes && strcmp(method, "values") != 0)
        return kmp_fail(o->context, KEMPE_E_ARGUMENT, "unknown method '%s'; available: slopes, values", method);
    if (slopes && !o->objective.runs)
        return kmp_fail(o->context, KEMPE_E_ARGUMENT, "no slopes are available: %s", o->objective.obstacle);
    o->method = slopes ? "slopes" : "values";
    o->free_method = !method;
    return KEMPE_OK;
}

/* -- the object -------------------------------------------------------------------------------------- */

kempe_status kempe_optimum_new(const kempe_model *model, const kempe_optimum_options *options, kempe_optimum **optimum)
{
    KMP_WANTED_BOTH(model, optimum);
    KMP_OPTIONS(model->context, kempe_optimum_options, options);
    double begin = kmp_cpu_now();
    kmp_model_begin_forces(model);
    KMP_TRY(kmp_model_check_finished(model));
    KMP_MAKE(model->context, kempe_optimum, o);
    o->context = model->context;
    o->model = model;
    o->best = -1;
    kempe_status status = prepare(o, options);
    if (status == KEMPE_OK) {
        const bool quiet = kmp_context_quiet(o->context, true);
        status = search_all(o);
        (void)kmp_context_quiet(o->context, quiet);
    }
    bool given = status == KEMPE_OK || (status == KEMPE_STOPPED && o->variant);
    if (given) {
        const kmp_searched *s = &o->search[o->best];
        if (s->broken > KMP_OPTIMUM_KEPT)
            kmp_doubt(
                o->context,
                "no values within the bounds satisfy all limits: the result violates them least, by %.2g of a limit",
                s->broken);
        if (s->outcome == KMP_SQUARES_MOST)
            kmp_doubt(o->context,
                      "the best search has not converged after %d evaluations: continue from its result, or allow more "
                      "(--most)",
                      s->evaluations);
        status = kmp_context_verdict(o->context, status);
        o->seconds += kmp_cpu_now() - begin + o->objective.helped_s;
        o->warnings = kmp_context_warnings(o->context);
        o->reason = kmp_strdup(kmp_is_complete(status) ? "" : kempe_context_message(o->context));
        o->status = status;
    }
    if (!given || !o->warnings || !o->reason) {
        kempe_optimum_free(o);
        return given ? kmp_fail_memory(model->context) : status;
    }
    *optimum = o;
    return status;
}

void kempe_optimum_free(kempe_optimum *optimum)
{
    if (!optimum)
        return;
    kmp_objective_free(&optimum->objective);
    kmp_variant_free(optimum->variant);
    for (int k = 0; k < optimum->searches; k++) {
        kmp_free(optimum->search[k].tried);
        kmp_free(optimum->search[k].refusal);
    }
    kmp_free(optimum->reason);
    kmp_free(optimum->warnings);
    kmp_arena_free(&optimum->arena);
    kmp_free(optimum);
}

KMP_GETTER(int kempe_optimum_count(const kempe_optimum *optimum), optimum, optimum->count, 0)
KMP_GETTER_AT(const char *kempe_optimum_name(const kempe_optimum *optimum, int k), optimum, k, optimum->count,
              optimum->bounded.name[k], "")
KMP_GETTER_AT(double kempe_optimum_value(const kempe_optimum *optimum, int k), optimum, k, optimum->count,
              optimum->value[k], NAN)
KMP_GETTER(double kempe_optimum_quantity(const kempe_optimum *optimum), optimum, optimum->at_best[0], NAN)
KMP_GETTER(int kempe_optimum_is_kept(const kempe_optimum *optimum), optimum,
           optimum->search[optimum->best].broken <= KMP_OPTIMUM_KEPT, 0)
KMP_GETTER(const char *kempe_optimum_method(const kempe_optimum *optimum), optimum, optimum->method, "")
