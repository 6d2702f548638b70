/* SPDX-License-Identifier: BSD-3-Clause */
/* Results of an ensemble: the state of each instance, as a summary, as JSON and as a table. */
#include "ensemble/batch.h"
#include "analyses/parts/study_print.h"
#include "backend/lanes.h"
#include "base/memory.h"
#include "ensemble/instance_table.h"
#include "ensemble/mechanisms.h"
#include "ensemble/quantity_words.h"
#include "ensemble/sampling/values.h"
#include "ensemble/statistics/statistics.h"
#include "model/data/model.h"
#include "model/read/loads.h"
#include "output/convergence.h"
#include "output/print.h"
#include "output/result_table.h"
#include "output/start_balance.h"
#include "studies/simulate/trajectory.h"
#include <math.h>
#include <string.h>

struct kempe_ensemble {
    const kempe_values *values;
    kmp_mechanisms *inner;
    const kempe_model *model;
    kmp_quantity_list quantities;
    bool doubted; /* of the current run: the model itself is doubted, and so is each instance */
};

struct kempe_ensemble_result {
    const kempe_ensemble *ensemble;
    kmp_arena arena;
    kempe_status status;
    int first, count, n; /* instances first .. first + count - 1 of the ensemble */
    kmp_ensemble_result *results;
    double *rows;                /* count x columns: the values */
    double *q, *qd;              /* count x n */
    double *taken, *differences; /* count x quantities; |difference| at another tolerance, NaN: not known */
    double *starts;              /* count x 2 n: of kmp_ensemble_execution */
    kmp_convergence *again;      /* count */
    double rtol, atol, t_end;
    kmp_ensemble_work work;
    char *warnings; /* of the computation, one per line */
};

/* -- columns ------------------------------------------------------------------------------------------ */

/* Columns of the results, after the columns of the values. */
static void put_result_columns(const kempe_ensemble *e, kempe_table *table)
{
    const kempe_system *system = kmp_mechanisms_system(e->inner);
    kmp_tabulate_columns(table, "status[words] t[s]");
    kmp_tabulate_quantity(table, system, KMP_QUANTITY_Q);
    kmp_tabulate_quantity(table, system, KMP_QUANTITY_QD);
    for (int k = 0; k < e->quantities.run.values; k++)
        kmp_tabulate_column(table, kmp_print_unknown(e->model->context, e->quantities.unit[k]), "%s",
                            e->quantities.name[k]);
    if (e->quantities.limit_count > 0)
        kmp_tabulate_columns(table, "limits[words] broken[words]");
    kmp_tabulate_columns(table, "steps rejected refused rhs exchanges h hdot drift difference");
    for (int k = 0; k < e->quantities.run.values; k++)
        kmp_tabulate_column(table, kmp_print_unknown(e->model->context, e->quantities.unit[k]), "%s.difference",
                            e->quantities.name[k]);
    kmp_tabulate_columns(table, "verdict[words] start[words] single_run[words] reason[words]");
}

/* A value whose name a column of the results has is the column value.NAME: names of columns are unique. */
static void put_all_columns(const kempe_ensemble *e, kempe_table *table)
{
    const kempe_system *system = kmp_mechanisms_system(e->inner);
    kempe_table *results = kmp_tabulate(e->model->context, "results");
    put_result_columns(e, results);
    const bool whole = results && kmp_tabulate_check(e->model->context, results) == KEMPE_OK;
    if (!whole)
        kmp_tabulate_fail(table);
    for (int k = 0; k < e->values->columns; k++) {
        const char *name = e->values->name[k];
        bool taken = whole && kempe_table_find(results, name) >= 0;
        kmp_tabulate_value(table, system, taken ? KMP_VALUE_PREFIX : "", name);
    }
    put_result_columns(e, table);
    kempe_table_free(results);
}

/* Refuses a quantity whose name another column of the results has. */
static kempe_status check_columns(const kempe_ensemble *e)
{
    kempe_context *context = e->model->context;
    kempe_table *table = kmp_tabulate(context, "instances");
    put_all_columns(e, table);
    kempe_status status = table ? kmp_tabulate_check(context, table) : kmp_fail_memory(context);
    for (int c = 0; status == KEMPE_OK && c < kempe_table_column_count(table); c++) {
        const char *name = kempe_table_column_name(table, c);
        if (kempe_table_find(table, name) != c)
            status =
                kmp_fail(context, KEMPE_E_ARGUMENT,
                         "quantity '%s': the results have another column of this name; give the quantity a name of "
                         "its own, NAME = EXPRESSION",
                         name);
    }
    kempe_table_free(table);
    return status;
}

/* -- run --------------------------------------------------------------------------------------------- */

kempe_status kempe_ensemble_new_with(const kempe_model *model, const kempe_values *values,
                                     const kempe_ensemble_options *options, kempe_ensemble **ensemble)
{
    KMP_WANTED_BOTH(model, values);
    KMP_WANTED(model->context, ensemble, "ensemble");
    KMP_OPTIONS(model->context, kempe_ensemble_options, options);
    kmp_context_clear(model->context);
    KMP_MAKE(model->context, kempe_ensemble, e);
    e->values = values;
    e->model = model;
    kempe_status status = kmp_quantity_list_init(&e->quantities, model, options->quantities, options->limits);
    if (status == KEMPE_OK)
        status =
            kmp_mechanisms_new(model, values->columns, (const char *const *)values->name, &e->quantities, &e->inner);
    if (status == KEMPE_OK)
        status = check_columns(e);
    return KMP_GIVE_OR_FREE(status, ensemble, e, kempe_ensemble_free);
}

kempe_status kempe_ensemble_new(const kempe_model *model, const kempe_values *values, kempe_ensemble **ensemble)
{
    return kempe_ensemble_new_with(model, values, NULL, ensemble);
}

KMP_FREES(kempe_ensemble, ensemble, kmp_mechanisms_free(ensemble->inner), kmp_quantity_list_free(&ensemble->quantities))

void kempe_ensemble_result_free(kempe_ensemble_result *batch)
{
    if (!batch)
        return;
    kmp_free(batch->warnings);
    for (int k = 0; batch->results && k < batch->count; k++)
        kmp_free(batch->results[k].reason);
    kmp_arena_free(&batch->arena);
    kmp_free(batch);
}

static kempe_ensemble_result *new_batch(const kempe_ensemble *e, const kmp_batch_range *range)
{
    size_t columns = (size_t)e->values->columns;
    kempe_ensemble_result *b = KMP_NEW(kempe_ensemble_result, 1);
    if (!b)
        return NULL;
    b->ensemble = e;
    b->first = range->first;
    b->count = range->count;
    b->n = kmp_mechanisms_system(e->inner)->n;
    KMP_ARENA_MAKE(&b->arena, KMP_ROOM(kmp_ensemble_result, b->count, &b->results),
                   KMP_ROOM(double, (size_t)b->count *columns, &b->rows),
                   KMP_ROOM(double, (size_t)b->count *(size_t)b->n, &b->q, &b->qd),
                   KMP_ROOM(double, 2 * (size_t)b->count * (size_t)b->n, &b->starts),
                   KMP_ROOM(double, (size_t)b->count *(size_t)e->quantities.run.values, &b->taken, &b->differences),
                   KMP_ROOM(kmp_convergence, b->count, &b->again));
    if (b->arena.failed) {
        kempe_ensemble_result_free(b);
        return NULL;
    }
    for (size_t k = 0; k < (size_t)b->count * (size_t)e->quantities.run.values; k++)
        b->differences[k] = NAN;
    for (size_t k = 0; k < 2 * (size_t)b->count * (size_t)b->n; k++)
        b->starts[k] = NAN;
    if (!range->rows)
        kmp_values_get(e->values, b->first, b->count, b->rows);
    else if (b->count > 0 && columns > 0)
        memcpy(b->rows, range->rows, (size_t)b->count * columns * sizeof *b->rows);
    return b;
}

/* The values of an instance of the batch. */
static const double *row_of(const kempe_ensemble_result *b, int k)
{
    return b->rows + (size_t)k * (size_t)b->ensemble->values->columns;
}

/* -- convergence ------------------------------------------------------------------------------------- */

/* Complete instances as cases. */
typedef struct repeat {
    kempe_ensemble_result *b;
    const kmp_run_spec *spec;
    const kmp_ensemble_execution *execution;
    int *instance; /* of a case */
} repeat;

/* Differences of the quantities of an instance; infinite for a value that only one of the runs has. */
static void compare_quantities(const kempe_ensemble_result *b, int instance, const double *other)
{
    int count = b->ensemble->quantities.run.values;
    const double *first = b->taken + (ptrdiff_t)instance * count;
    double *difference = b->differences + (ptrdiff_t)instance * count;
    for (int v = 0; v < count; v++)
        difference[v] = isnan(first[v]) && isnan(other[v])   ? 0
                        : isnan(first[v]) || isnan(other[v]) ? INFINITY
                                                             : fabs(first[v] - other[v]);
}

static kempe_status run_again(void *user, double rtol, int count, const int *which, kmp_convergence *found)
{
    const repeat *r = user;
    size_t columns = (size_t)r->b->ensemble->values->columns, n = (size_t)r->b->n, many = (size_t)count;
    kmp_run_spec other = *r->spec;
    kmp_ensemble_execution execution = *r->execution;
    kmp_arena arena = {0};
    double *rows = KMP_ARENA_NEW(&arena, double, many *columns), *q = KMP_ARENA_NEW(&arena, double, many *n),
           *qd = KMP_ARENA_NEW(&arena, double, many *n), *starts = KMP_ARENA_NEW(&arena, double, 2 * many * n),
           *taken = KMP_ARENA_NEW(&arena, double, many *(size_t)r->b->ensemble->quantities.run.values + 1);
    kmp_ensemble_result *results = KMP_ARENA_NEW(&arena, kmp_ensemble_result, count);
    kempe_context *context = r->b->ensemble->model->context;
    kempe_status status = arena.failed ? kmp_fail_memory(context) : KEMPE_OK;
    other.rtol = rtol;
    other.atol *= rtol / r->spec->rtol;
    execution.taken = taken;
    execution.starts = starts;
    execution.total = execution.total > 0 ? -1 : 0; /* a part's progress is the progress of its first run */
    for (int k = 0; status == KEMPE_OK && k < count; k++) {
        const size_t first = (size_t)r->instance[which[k]];
        memcpy(rows + (size_t)k * columns, row_of(r->b, (int)first), columns * sizeof *rows);
        memcpy(starts + 2 * (size_t)k * n, r->b->starts + 2 * first * n, 2 * n * sizeof *starts);
    }
    if (status == KEMPE_OK)
        status = kmp_mechanisms_run(r->b->ensemble->inner, &other, &execution, count, rows, results, q, qd);
    if (status == KEMPE_OK && kmp_interrupted(context))
        status = KEMPE_STOPPED;
    if (status == KEMPE_OK) {
        /* Compares the results of repeated instances with the results of the first run. */
        const kempe_ensemble_result *b = r->b;
        const kempe_system *system = kmp_mechanisms_system(b->ensemble->inner);
        for (int k = 0; k < count; k++) {
            int first = r->instance[which[k]];
            ptrdiff_t at = (ptrdiff_t)k * b->n;
            if (results[k].status == KEMPE_OK)
                kmp_convergence_state(&found[k], results[k].t, system, kempe_ensemble_result_q(b, first),
                                      kempe_ensemble_result_qd(b, first), q + at, qd + at);
            else
                found[k].stopped = results[k].t;
            if (results[k].status == KEMPE_OK)
                compare_quantities(b, first, taken + (ptrdiff_t)k * b->ensemble->quantities.run.values);
        }
    }
    for (int k = 0; results && k < count; k++)
        kmp_free(results[k].reason);
    kmp_arena_free(&arena);
    return status;
}

static const char *again_name(const kempe_ensemble_result *b, int k)
{
    return b->n > 0 ? b->ensemble->model->motions[b->again[k].index].name : "";
}

/* A model without a length has no size that small motions could be compared with: each instance is judged by the way
 * from its start to its end. NULL without an error: the model has a size. */
static double *visible_of(const kempe_ensemble_result *b, const kmp_run_spec *spec, int cases, const int *instance,
                          kmp_arena *arena)
{
    const kempe_system *system = kmp_mechanisms_system(b->ensemble->inner);
    const int n = b->n;
    if (kmp_system_length_scale(system->model).length > 0)
        return NULL;
    double *visible = KMP_ARENA_NEW(arena, double, (ptrdiff_t)cases *n);
    for (int i = 0; visible && i < cases; i++) {
        const double *start = b->starts + (ptrdiff_t)2 * instance[i] * n;
        for (int k = 0; k < n; k++) {
            const bool state = k >= kmp_model_coordinates(system->model);
            const double *end = (state ? kempe_ensemble_result_qd : kempe_ensemble_result_q)(b, instance[i]);
            const double begun = start[state ? n + k : k], way = fabs(end[k] - (isnan(begun) ? 0 : begun));
            visible[(ptrdiff_t)i * n + k] = kmp_visible_difference(system, spec, false, k, way);
        }
    }
    return visible;
}

static kempe_status check_again(kempe_ensemble_result *b, const kmp_run_spec *spec,
                                const kmp_ensemble_execution *execution)
{
    kempe_context *context = b->ensemble->model->context;
    kmp_arena arena = {0};
    int cases = 0, *instance = KMP_ARENA_NEW(&arena, int, b->count);
    kmp_convergence *found = KMP_ARENA_NEW(&arena, kmp_convergence, b->count);
    kempe_status status = arena.failed ? kmp_fail_memory(context) : KEMPE_OK;
    for (int k = 0; status == KEMPE_OK && k < b->count; k++)
        if (b->results[k].status == KEMPE_OK)
            instance[cases++] = k;
    repeat r = {b, spec, execution, instance};
    const double *visible = status == KEMPE_OK ? visible_of(b, spec, cases, instance, &arena) : NULL;
    status = status == KEMPE_OK && arena.failed ? kmp_fail_memory(context) : status;
    const kmp_repeat again = {
        .context = context, .rtol = spec->rtol, .visible = visible, .numbers = b->n, .user = &r, .run = run_again};
    if (status == KEMPE_OK && cases > 0)
        status = kmp_convergence_of(&again, cases, found);
    for (int k = 0; status == KEMPE_OK && k < cases; k++) {
        b->again[instance[k]] = found[k];
        b->again[instance[k]].visible = NULL;
    }
    kmp_arena_free(&arena);
    return status;
}

/* -- a whole run ------------------------------------------------------------------------------------- */

static kempe_status run_batch(kempe_ensemble_result *b, const kmp_batch_range *range, const kmp_run_spec *spec,
                              int lanes, bool once)
{
    const kempe_ensemble *e = b->ensemble;
    const kmp_ensemble_execution execution = {.threads = spec->threads,
                                              .width = lanes > 0 ? lanes : 0,
                                              .alone = lanes < 0,
                                              .before = range->before,
                                              .total = range->total};
    kmp_ensemble_execution measured = execution;
    measured.taken = b->taken;
    measured.starts = b->starts;
    if (e->quantities.last_time > spec->t_end)
        return kmp_fail(e->model->context, KEMPE_E_ARGUMENT,
                        "a quantity is requested at t = %.6g s, after the end of the runs at %.6g s",
                        e->quantities.last_time, spec->t_end);
    kempe_status status = kmp_mechanisms_run(e->inner, spec, &measured, b->count, b->rows, b->results, b->q, b->qd);
    b->work = kmp_mechanisms_get_work(e->inner);
    b->rtol = spec->rtol;
    b->atol = spec->atol;
    b->t_end = spec->t_end;
    if (status != KEMPE_OK)
        return status;
    b->status = kmp_interrupted(e->model->context) ? KEMPE_STOPPED : KEMPE_OK;
    if (b->status == KEMPE_OK && !once)
        KMP_TRY(check_again(b, spec, &execution));
    /* Gives the warnings that each instance would have given; totals of a part of a longer run belong to the whole.
     */
    if (range->total > 0)
        return KEMPE_OK;
    kempe_context *context = b->ensemble->model->context;
    kempe_table *table = NULL;
    KMP_TRY(kempe_ensemble_result_table(b, "instances", &table));
    const kmp_instance_sums sums = kmp_instances_sum(table, b->first);
    kempe_table_free(table);
    KMP_TRY(kmp_instances_warn(context, &sums));
    if (b->count > 0 && sums.failed == b->count)
        b->status = kmp_fail(e->model->context, KEMPE_E_FAILED, "no instance reached its end; the first one: %s",
                             kempe_ensemble_result_reason(b, 0));
    return KEMPE_OK;
}

kempe_status kmp_batch_check_lanes(kempe_context *context, int lanes)
{
    if (lanes >= -1 && lanes <= KMP_LANES_MOST)
        return KEMPE_OK;
    return kmp_fail(context, KEMPE_E_ARGUMENT,
                    "%d instances at a time are not possible: give 1 to %d, 0 for the best number, -1 for every "
                    "instance separately",
                    lanes, KMP_LANES_MOST);
}

kempe_status kmp_batch_new(kempe_ensemble *e, const kempe_run_options *run, int lanes, const kmp_batch_range *range,
                           kempe_ensemble_result **batch)
{
    kempe_context *context = e->model->context;
    kmp_run_spec spec;
    kmp_arena arena = {0};
    KMP_TRY(kmp_batch_check_lanes(context, lanes));
    kempe_ensemble_result *b = new_batch(e, range);
    kempe_status status =
        b ? kmp_spec_of(kmp_mechanisms_system(e->inner), run, &arena, &spec) : kmp_fail_memory(context);
    if (status == KEMPE_OK)
        status = run_batch(b, range, &spec, lanes, run->no_convergence_check != 0);
    kmp_arena_free(&arena);
    if (status != KEMPE_OK) {
        kempe_ensemble_result_free(b);
        return status;
    }
    b->warnings = kmp_context_warnings(context);
    b->status = kmp_context_verdict(context, b->status);
    *batch = b;
    return b->status;
}

kempe_status kempe_ensemble_run(kempe_ensemble *e, const kempe_run_options *run, int lanes,
                                kempe_ensemble_result **batch)
{
    return kempe_ensemble_run_range(e, run, lanes, 0, e ? e->values->count : 0, batch);
}

void kmp_ensemble_begin(kempe_ensemble *e)
{
    kmp_model_begin_forces(e->model);
    e->doubted = kmp_context_verdict(e->model->context, KEMPE_OK) != KEMPE_OK;
}

kempe_status kempe_ensemble_run_range(kempe_ensemble *e, const kempe_run_options *run, int lanes, int first, int count,
                                      kempe_ensemble_result **batch)
{
    KMP_WANTED(NULL, e, "ensemble");
    KMP_WANTED(e->model->context, batch, "batch");
    KMP_OPTIONS(e->model->context, kempe_run_options, run);
    KMP_TRY(kmp_run_options_check(e->model->context, run, KMP_STUDY_ENSEMBLE));
    kmp_ensemble_begin(e);
    if (first < 0 || count < 0 || first > e->values->count - count)
        return kmp_fail(e->model->context, KEMPE_E_ARGUMENT, "there are no %d instances from %d: there are %d", count,
                        first, e->values->count);
    return kmp_batch_new(e, run, lanes, &(kmp_batch_range){.first = first, .count = count}, batch);
}

kempe_status kempe_ensemble_run_rows(kempe_ensemble *e, const kempe_run_options *run, int lanes, int count,
                                     const double *rows, kempe_ensemble_result **batch)
{
    KMP_WANTED(NULL, e, "ensemble");
    KMP_WANTED(e->model->context, batch, "batch");
    KMP_OPTIONS(e->model->context, kempe_run_options, run);
    KMP_TRY(kmp_run_options_check(e->model->context, run, KMP_STUDY_ENSEMBLE));
    kmp_ensemble_begin(e);
    if (count < 0)
        return kmp_fail(e->model->context, KEMPE_E_ARGUMENT, "the number of rows is %d; it cannot be negative", count);
    KMP_WANTED(e->model->context, rows || count == 0 || e->values->columns == 0, "rows");
    return kmp_batch_new(e, run, lanes, &(kmp_batch_range){.count = count, .rows = rows}, batch);
}

/* -- queries ----------------------------------------------------------------------------------------- */

KMP_GETTER(int kempe_ensemble_result_count(const kempe_ensemble_result *b), b, b->count, 0)
/* The outcome of an instance, which its own repeat or start, or a doubt of its model, may contradict. */
static kempe_outcome outcome_of(const kempe_ensemble_result *b, int k)
{
    kempe_status status = b->results[k].status;
    bool doubted = b->ensemble->doubted || b->work.doubted || b->results[k].unstable ||
                   !kmp_convergence_holds(&b->again[k]) || b->results[k].deflects || b->results[k].shares;
    return kmp_outcome_of(status == KEMPE_OK && doubted ? KEMPE_UNTRUSTED : status);
}

KMP_GETTER_AT(kempe_outcome kempe_ensemble_result_outcome(const kempe_ensemble_result *b, int k), b, k, b->count,
              outcome_of(b, k), KEMPE_OUTCOME_NONE)
KMP_GETTER_AT(const char *kempe_ensemble_result_reason(const kempe_ensemble_result *b, int k), b, k, b->count,
              b->results[k].reason ? b->results[k].reason : "", "")
KMP_GETTER_AT(const double *kempe_ensemble_result_q(const kempe_ensemble_result *b, int k), b, k, b->count,
              b->q + (size_t)k * (size_t)b->n, NULL)
KMP_GETTER_AT(const double *kempe_ensemble_result_qd(const kempe_ensemble_result *b, int k), b, k, b->count,
              b->qd + (size_t)k * (size_t)b->n, NULL)

/* -- quantities and limits --------------------------------------------------------------------------- */

static const kmp_quantity_list *list_of(const kempe_ensemble_result *b)
{
    return &b->ensemble->quantities;
}

static const double *taken_of(const kempe_ensemble_result *b, int k)
{
    return b->taken + (size_t)k * (size_t)list_of(b)->run.values;
}

static const double *differences_of(const kempe_ensemble_result *b, int k)
{
    return b->differences + (size_t)k * (size_t)list_of(b)->run.values;
}

KMP_GETTER(int kempe_ensemble_result_quantity_count(const kempe_ensemble_result *b), b, list_of(b)->run.values, 0)
KMP_GETTER_AT(const char *kempe_ensemble_result_quantity_name(const kempe_ensemble_result *b, int value), b, value,
              list_of(b)->run.values, list_of(b)->name[value], "")
KMP_GETTER_AT(const char *kempe_ensemble_result_quantity_unit(const kempe_ensemble_result *b, int value), b, value,
              list_of(b)->run.values, list_of(b)->unit[value], "")

double kempe_ensemble_result_quantity(const kempe_ensemble_result *b, int k, int value)
{
    if (!b || k < 0 || k >= b->count || value < 0 || value >= list_of(b)->run.values)
        return NAN;
    return taken_of(b, k)[value];
}

/* Appends the limits that an instance does not keep (text NULL: none is written); their number, -1: not known. */
static int broken_of(const kempe_ensemble_result *b, int k, kmp_text *text)
{
    const kmp_quantity_list *list = list_of(b);
    int broken = 0;
    for (int i = 0; i < list->limit_count; i++) {
        double value = taken_of(b, k)[list->limit[i].value];
        if (isnan(value))
            return -1;
        if (kmp_limit_holds(&list->limit[i], value))
            continue;
        if (text)
            kmp_text_printf(text, "%s%s", broken ? "; " : "", list->limit[i].text);
        broken++;
    }
    return broken;
}

const char *kempe_ensemble_result_limits(const kempe_ensemble_result *b, int k)
{
    if (!b || k < 0 || k >= b->count || list_of(b)->limit_count == 0)
        return "";
    int broken = broken_of(b, k, NULL);
    return broken < 0 ? "" : broken > 0 ? "fail" : "pass";
}

static const char *alone_of(const kmp_ensemble_result *r)
{
    return r->alone && r->why ? r->why : "";
}

/* Why a part of an instance was run by itself. */
static const char *apart_of(const kmp_ensemble_result *r)
{
    return !r->alone && r->parts > 0 && r->why ? r->why : "";
}

/* -- messages ---------------------------------------------------------------------------------------- */

/* Why instances were run by themselves, or parts of them, each reason once, in the order of the first. */
static void put_reasons(const kempe_ensemble_result *b, const char *reason_of(const kmp_ensemble_result *r),
                        const char *how, kmp_text *text)
{
    for (int k = 0; k < b->count; k++) {
        const char *why = reason_of(&b->results[k]);
        int before = 0, after = 0;
        for (int i = 0; *why && i < b->count && before == 0; i++)
            if (strcmp(reason_of(&b->results[i]), why) == 0) {
                before += i < k;
                after++;
            }
        kmp_text words = {0};
        kmp_text_printf(&words, "%d instance%s ran %s because of: %s", after, after == 1 ? "" : "s", how, why);
        if (after > 0 && before == 0)
            kmp_print_wrapped(text, "          ", 10, words.s ? words.s : "");
        kmp_text_free_part(text, &words);
    }
}

/* The instance with the largest difference relative to its limit, or with an incomplete second run, and its
 * coordinate. */
static void put_repeat(const kempe_ensemble_result *b, kmp_text *text)
{
    int worst = -1;
    double most = 0;
    for (int k = 0; k < b->count; k++) {
        const kmp_convergence *c = &b->again[k];
        double part = !c->known ? 0 : isnan(c->stopped) ? c->difference / c->limit : INFINITY;
        if (c->known && (worst < 0 || part > most)) {
            worst = k;
            most = part;
        }
    }
    if (worst < 0)
        return;
    kmp_text words = {0};
    kmp_text_printf(&words, "instance %d is the worst: ", b->first + worst + 1);
    kmp_convergence_put(&words, b->ensemble->model->context, &b->again[worst], again_name(b, worst), NULL);
    kmp_print_wrapped(text, "accuracy  ", 10, words.s ? words.s : "");
    kmp_text_free_part(text, &words);
}

/* The table of the instances, and their statistics where they have quantities; NULL otherwise. */
typedef struct summary {
    kempe_table *table;
    kempe_statistics *statistics;
} summary;

/* In SI: texts convert what they show. */
static bool summarise(const kempe_ensemble_result *b, summary *s)
{
    *s = (summary){0};
    kempe_context *context = b->ensemble->model->context;
    const kmp_shown_in shown = kmp_context_show_in(context, (kmp_shown_in){0});
    const kempe_status status = kempe_ensemble_result_table(b, "instances", &s->table);
    (void)kmp_context_show_in(context, shown);
    if (status != KEMPE_OK)
        return false;
    return list_of(b)->run.values == 0 || !kmp_is_complete(b->status) ||
           kempe_statistics_new(s->table, 0, &s->statistics) == KEMPE_OK;
}

static void free_summary(summary *s)
{
    kempe_statistics_free(s->statistics);
    kempe_table_free(s->table);
}

static void put_text(kmp_text *text, const void *result)
{
    const kempe_ensemble_result *b = result;
    summary s;
    kmp_instance_causes causes = {0};
    if (summarise(b, &s)) {
        kmp_instance_sums sums = kmp_instances_sum(s.table, b->first);
        sums.doubted = b->status == KEMPE_UNTRUSTED;
        const kempe_outcome outcome = b->status == KEMPE_STOPPED ? KEMPE_OUTCOME_STOPPED : kmp_instances_outcome(&sums);
        kmp_instance_causes_add(&causes, s.table, b->first);
        kmp_instances_put_answer(text, b->ensemble->model->name, outcome, &sums, &causes);
        kmp_starts_show(text, "instance", kmp_model_start(b->ensemble->model)->at);
        kmp_print_doubts(text, outcome, b->warnings);
        kmp_text_put(text, "\n");
        const size_t head = text->length;
        put_repeat(b, text);
        kmp_instances_put_accuracy(text, text->length > head ? "" : "accuracy", &sums);
        kmp_instances_put_measured(text, s.table, b->first);
        kmp_text_printf(text, "run       0 to %.6g s, rtol %g, atol %g; %.3g ms per instance, %.2g s on %d thread%s\n",
                        b->t_end, b->rtol, b->atol, b->count > 0 ? 1e3 * b->work.cpu_s / b->count : 0.0, b->work.wall_s,
                        b->work.threads, b->work.threads == 1 ? "" : "s");
        if (b->work.lane_steps == 0)
            kmp_text_put(text, "          every instance separately\n");
        put_reasons(b, alone_of, "separately", text);
        put_reasons(b, apart_of, "in part separately", text);
        kmp_instances_put_statistics(text, s.statistics);
    } else {
        text->failed = true;
    }
    kmp_instance_causes_free(&causes);
    free_summary(&s);
}

static void put_instance(const kempe_ensemble_result *b, kmp_json *json, int k)
{
    const kmp_ensemble_result *r = &b->results[k];
    kmp_json_object(json, NULL);
    kmp_json_numbers(json, "values", b->ensemble->values->columns, row_of(b, k));
    kmp_json_put(json, "status %s reason %s t %g", kempe_outcome_text(outcome_of(b, k)),
                 kempe_ensemble_result_reason(b, k), r->t);
    kmp_json_numbers(json, "q", b->n, kempe_ensemble_result_q(b, k));
    kmp_json_numbers(json, "qd", b->n, kempe_ensemble_result_qd(b, k));
    if (list_of(b)->run.values > 0) {
        kmp_json_numbers(json, "quantities", list_of(b)->run.values, taken_of(b, k));
        kmp_json_numbers(json, "quantity_differences", list_of(b)->run.values, differences_of(b, k));
    }
    if (list_of(b)->limit_count > 0)
        kmp_json_put(json, "limits %s", kempe_ensemble_result_limits(b, k));
    kmp_json_put(json, "steps %ld rejected %ld refused %ld rhs %ld exchanges %ld h %g hdot %g drift %g single_run %s",
                 r->steps, r->rejected, r->refused, r->rhs, r->exchanges, r->h, r->hdot, r->drift, alone_of(r));
    kmp_convergence_json(json, &b->again[k], again_name(b, k));
    kmp_json_end(json);
}

static void put_json(kmp_text *text, const void *result)
{
    const kempe_ensemble_result *b = result;
    const kempe_system *system = kmp_mechanisms_system(b->ensemble->inner);
    summary made;
    bool good = summarise(b, &made);
    kmp_instance_sums s = good ? kmp_instances_sum(made.table, b->first) : (kmp_instance_sums){0};
    s.doubted = b->status == KEMPE_UNTRUSTED;
    kmp_json json = kmp_print_head(
        text, system, b->status == KEMPE_STOPPED ? KEMPE_OUTCOME_STOPPED : kmp_instances_outcome(&s),
        kmp_is_complete(b->status) ? "" : "not every instance reached its end", system->build_s, b->warnings);
    kmp_json_put(&json, "count %ld complete %ld stopped %ld failed %ld", s.count, s.ok, s.stopped, s.failed);
    kmp_json_put(
        &json,
        "not_converged %ld lanes %d single_run %d rtol %g atol %g t_end %g threads %d cpu_s %g wall_s %g columns [",
        s.not_converged, b->work.lane_steps > 0 ? b->work.width : 0, b->work.alone, b->rtol, b->atol, b->t_end,
        b->work.threads, b->work.cpu_s, b->work.wall_s);
    for (int k = 0; k < b->ensemble->values->columns; k++)
        kmp_json_string(&json, NULL, b->ensemble->values->name[k]);
    kmp_json_put(&json, "] coordinates [");
    for (int k = 0; k < b->n; k++)
        kmp_json_string(&json, NULL, system->model->motions[k].name);
    kmp_json_put(&json, "] quantities [");
    for (int k = 0; k < list_of(b)->run.values; k++)
        kmp_json_put(&json, "{ name %s unit %s }", list_of(b)->name[k], list_of(b)->unit[k]);
    kmp_json_put(&json, "] instances [");
    for (int k = 0; k < b->count; k++)
        put_instance(b, &json, k);
    kmp_json_put(&json, "]");
    if (made.statistics)
        kmp_statistics_put(&json, "statistics", made.statistics);
    kmp_json_put(&json, "}");
    text->failed = text->failed || !good;
    free_summary(&made);
}

KMP_PRINT(kempe_ensemble_result, batch, batch->ensemble->model->context, put_json, put_text)

/* -- as a table -------------------------------------------------------------------------------------- */

static void put_row(const kempe_ensemble_result *b, kempe_table *table, int k)
{
    const kmp_ensemble_result *r = &b->results[k];
    const kmp_convergence *again = &b->again[k];
    const kempe_system *system = kmp_mechanisms_system(b->ensemble->inner);
    kmp_tabulate_row(table);
    kmp_tabulate_numbers(table, b->ensemble->values->columns, row_of(b, k));
    kmp_tabulate_cells(table, "%s %g", kempe_outcome_text(outcome_of(b, k)), r->t);
    kmp_tabulate_values(table, system, KMP_QUANTITY_Q, kempe_ensemble_result_q(b, k));
    kmp_tabulate_values(table, system, KMP_QUANTITY_QD, kempe_ensemble_result_qd(b, k));
    kmp_tabulate_numbers(table, list_of(b)->run.values, taken_of(b, k));
    if (list_of(b)->limit_count > 0) {
        kmp_text broken = {0};
        bool known = broken_of(b, k, &broken) >= 0;
        kmp_tabulate_cells(table, "%s %s", kempe_ensemble_result_limits(b, k), known && broken.s ? broken.s : "");
        if (broken.failed)
            kmp_tabulate_fail(table);
        kmp_text_free(&broken);
    }
    kmp_tabulate_cells(table, "%ld %ld %ld %ld %ld %g %g %g", r->steps, r->rejected, r->refused, r->rhs, r->exchanges,
                       r->h, r->hdot, r->drift);
    kmp_tabulate_number(table, again->known ? again->difference : NAN);
    kmp_tabulate_numbers(table, list_of(b)->run.values, differences_of(b, k));
    const bool holds = kmp_convergence_holds(again);
    const char *verdict = holds && r->deflects ? KMP_DEFLECTED_FAR
                          : holds && r->shares ? KMP_LOADS_SHARED
                                               : kmp_convergence_word(again);
    const char *start = r->unstable        ? KMP_BALANCE_UNSTABLE
                        : r->leaves        ? KMP_EQUILIBRIUM_UNSTABLE
                        : r->rates_changed ? KMP_RATES_ADJUSTED
                        : r->gaps_changed  ? KMP_GAPS_CHANGED
                                           : "";
    kmp_tabulate_cells(table, "%s %s %s %s", verdict, start, alone_of(r), kempe_ensemble_result_reason(b, k));
}

static void fill_instances(kempe_table *table, const void *result)
{
    const kempe_ensemble_result *b = result;
    put_all_columns(b->ensemble, table);
    kmp_tabulate_apart(table);
    for (int k = 0; k < b->count; k++)
        put_row(b, table, k);
}

KMP_TABLES(kempe_ensemble_result, batch, batch->ensemble->model->context, {"instances", fill_instances})

/* -- parts of a longer run --------------------------------------------------------------------------- */

void kmp_batch_add(const kempe_ensemble_result *b, const kempe_table *instances, kmp_batch_totals *sum)
{
    const kmp_instance_sums part = kmp_instances_sum(instances, b->first);
    kmp_instances_add(&sum->sums, &part);
    sum->alone += b->work.alone;
    sum->threads = b->work.threads > sum->threads ? b->work.threads : sum->threads;
    sum->cpu_s += b->work.cpu_s;
}

kempe_status kmp_ensemble_columns(kempe_ensemble *e, kempe_table **table)
{
    kempe_ensemble_result *b = new_batch(e, &(kmp_batch_range){0});
    KMP_TRY(kmp_made(e->model->context, b));
    kempe_status status = kempe_ensemble_result_table(b, "instances", table);
    kempe_ensemble_result_free(b);
    return status;
}

const kempe_model *kmp_ensemble_model(const kempe_ensemble *e)
{
    return e->model;
}

const kmp_quantity_list *kmp_ensemble_quantities(const kempe_ensemble *ensemble)
{
    return &ensemble->quantities;
}

const kempe_values *kmp_ensemble_values(const kempe_ensemble *e)
{
    return e->values;
}

const kempe_system *kmp_ensemble_equations(const kempe_ensemble *e)
{
    return kmp_mechanisms_system(e->inner);
}

/* -- for pages --------------------------------------------------------------------------------------- */

const kempe_model *kmp_batch_model(const kempe_ensemble_result *batch)
{
    return batch->ensemble->model;
}

kempe_status kmp_batch_status(const kempe_ensemble_result *batch)
{
    return batch->status;
}

const char *kmp_batch_warnings(const kempe_ensemble_result *batch)
{
    return batch->warnings;
}

double kmp_batch_cpu(const kempe_ensemble_result *batch)
{
    return batch->work.cpu_s;
}
