/* SPDX-License-Identifier: BSD-3-Clause */
/* Time histories of chosen instances of an ensemble: each is the table of a separate run, as `kempe simulate --from`
 * makes it. So its rows depend only on the instance, not on threads, parts or lanes. */
#include "ensemble/histories.h"
#include "constraints/inexact/nearest_exact.h"
#include "ensemble/batch.h"
#include "ensemble/result_folder.h"
#include "ensemble/sampling/model_instances.h"
#include "ensemble/sampling/values.h"
#include "model/data/model_context.h"
#include "model/read/loads.h"
#include "output/result_table.h"
#include "pipeline.h"
#include "studies/simulate/trajectory.h"
#include <ctype.h>
#include <limits.h>
#include <string.h>

/* -- choice ------------------------------------------------------------------------------------------- */

/* Reads a whole number and the blanks around it; the end of what was read. */
static const char *read_instance(const char *s, int *value)
{
    long number = 0;
    s += strspn(s, " ");
    if (!isdigit((unsigned char)*s))
        return NULL;
    for (; isdigit((unsigned char)*s); s++)
        number = number < INT_MAX ? 10 * number + (*s - '0') : number;
    *value = number < INT_MAX ? (int)number : INT_MAX;
    return s + strspn(s, " ");
}

static kempe_status read_range(kempe_context *context, const char *words, const char **at, int instances,
                               struct kmp_instance_range *range)
{
    int from = 0, to = 0, column = (int)(*at - words) + 1;
    const char *s = read_instance(*at, &from);
    to = from;
    if (s && *s == ':')
        s = read_instance(s + 1, &to);
    if (!s || (*s != ',' && *s))
        return kmp_fail(context, KEMPE_E_ARGUMENT,
                        "history:1:%d: '%s': instances are numbers and ranges A:B, separated by commas", column, *at);
    if (from < 1 || to < from || to > instances)
        return kmp_fail(context, KEMPE_E_ARGUMENT, "history:1:%d: there are no instances %d to %d: there are 1 to %d",
                        column, from, to, instances);
    *range = (struct kmp_instance_range){from - 1, to - 1};
    *at = s + (*s == ',');
    return KEMPE_OK;
}

kempe_status kmp_instance_ranges_read(kempe_context *context, kmp_arena *arena, const char *words, int instances,
                                      kmp_instance_ranges *ranges)
{
    int most = 1;
    *ranges = (kmp_instance_ranges){0};
    if (!words || !*words)
        return KEMPE_OK;
    for (const char *s = words; *s; s++)
        most += *s == ',';
    ranges->range = KMP_ARENA_NEW(arena, struct kmp_instance_range, most);
    KMP_TRY(kmp_made(context, ranges->range));
    for (const char *s = words; *s;)
        KMP_TRY(read_range(context, words, &s, instances, &ranges->range[ranges->count++]));
    return KEMPE_OK;
}

bool kmp_instance_ranges_meet(const kmp_instance_ranges *ranges, int first, int count)
{
    bool meets = false;
    for (int k = 0; k < ranges->count; k++)
        meets = meets || (ranges->range[k].from < first + count && ranges->range[k].to >= first);
    return meets;
}

/* -- histories ---------------------------------------------------------------------------------------- */

typedef struct history {
    kempe_ensemble *ensemble;
    kempe_context *context;
    kempe_run_options run; /* resolved: the settings that the ensemble has */
    double *values;        /* of one instance */
    bool has_columns;
    kempe_table *table;
} history;

/* A run that fails gives the rows up to there; one that cannot start gives none. */
static kempe_status run_model(history *h, int instance, const kempe_model *model)
{
    kempe_system *system = NULL;
    kempe_trajectory *trajectory = NULL;
    kempe_table *rows = NULL;
    KMP_TRY(kmp_system_new(model, NULL, &system));
    kempe_status status = kmp_simulate(system, &h->run, &trajectory);
    if (trajectory && !kmp_interrupted(h->context)) {
        kempe_status made = kempe_trajectory_table(trajectory, "rows", &rows);
        status = made == KEMPE_OK ? status : made;
    }
    if (rows) {
        /* Columns come with the first rows. */
        int columns = kempe_table_column_count(rows);
        for (int c = 0; c < columns && !h->has_columns; c++)
            kmp_tabulate_column(h->table, kempe_table_unit(rows, c), "%s", kempe_table_column_name(rows, c));
        h->has_columns = true;
        for (int row = 0; row < kempe_table_row_count(rows); row++) {
            kmp_tabulate_row(h->table);
            kmp_tabulate_number(h->table, instance + 1);
            for (int c = 0; c < columns; c++)
                kmp_tabulate_number(h->table, kempe_table_number(rows, row, c));
        }
    }
    kempe_table_free(rows);
    kempe_trajectory_free(trajectory);
    kempe_system_free(system);
    return status;
}

static kempe_status add_instance(history *h, int instance)
{
    const kempe_values *values = kmp_ensemble_values(h->ensemble);
    kempe_model *model = NULL;
    kmp_values_get(values, instance, 1, h->values);
    kempe_status status = kmp_model_instance(kmp_ensemble_model(h->ensemble), values->columns,
                                             (const char *const *)values->name, h->values, &model);
    if (status == KEMPE_OK)
        status = run_model(h, instance, model);
    kempe_model_free(model);
    if (status == KEMPE_STOPPED && !kmp_interrupted(h->context))
        status = KEMPE_OK; /* a lock of the mechanism: the table ends there */
    if (status == KEMPE_E_FAILED || status == KEMPE_E_INPUT) {
        kmp_context_clear(h->context); /* the row of the instance has the reason */
        status = KEMPE_OK;
    }
    return status == KEMPE_OK ? kmp_tabulate_check(h->context, h->table) : status;
}

/* The settings that all instances have, without settings that concern only the ensemble. */
static kempe_status resolve(history *h, const kempe_run_options *run, kmp_arena *arena)
{
    kmp_run_spec spec;
    KMP_TRY(kmp_spec_of(kmp_ensemble_equations(h->ensemble), run, arena, &spec));
    h->run = *run;
    kmp_spec_numbers(&spec, &h->run);
    h->run.threads = 0;
    h->run.reference = h->run.checkpoint = h->run.resume = NULL;
    h->run.no_convergence_check = 1;
    h->values = KMP_ARENA_NEW(arena, double, kmp_ensemble_values(h->ensemble)->columns + 1);
    return kmp_made(h->context, !arena->failed);
}

kempe_status kmp_histories(kempe_ensemble *ensemble, const kempe_run_options *run, const kmp_instance_ranges *ranges,
                           int first, int count, kempe_table **table)
{
    history h = {.ensemble = ensemble, .context = kmp_model_context(kmp_ensemble_model(ensemble))};
    kmp_arena arena = {0};
    kempe_status status = resolve(&h, run, &arena);
    h.table = status == KEMPE_OK ? kmp_tabulate(h.context, "history") : NULL;
    kmp_tabulate_columns(h.table, "instance");
    const bool quiet = kmp_context_quiet(h.context, true); /* warnings belong to the ensemble */
    for (int k = first; k < first + count && status == KEMPE_OK; k++)
        if (kmp_instance_ranges_meet(ranges, k, 1))
            status = add_instance(&h, k);
    (void)kmp_context_quiet(h.context, quiet);
    kmp_arena_free(&arena);
    if (status == KEMPE_OK)
        return kmp_tabulate_finish(h.context, h.table, table);
    kempe_table_free(h.table);
    return status;
}

kempe_status kempe_ensemble_history(kempe_ensemble *ensemble, const kempe_run_options *run, const char *instances,
                                    kempe_table **table)
{
    KMP_WANTED(NULL, ensemble, "ensemble");
    kempe_context *context = kmp_model_context(kmp_ensemble_model(ensemble));
    KMP_WANTED(context, instances, "instances");
    KMP_WANTED(context, table, "table");
    KMP_OPTIONS(context, kempe_run_options, run);
    KMP_TRY(kmp_run_options_check(context, run, KMP_STUDY_HISTORY));
    kmp_arena arena = {0};
    kmp_instance_ranges ranges;
    int count = kmp_ensemble_values(ensemble)->count;
    kmp_model_begin_forces(kmp_ensemble_model(ensemble));
    kempe_status status = kmp_instance_ranges_read(context, &arena, instances, count, &ranges);
    if (status == KEMPE_OK)
        status = kmp_histories(ensemble, run, &ranges, 0, count, table);
    kmp_arena_free(&arena);
    return status;
}
