/* SPDX-License-Identifier: BSD-3-Clause */
/* A trajectory as tables. */
#include "base/memory.h"
#include "output/result_table.h"
#include "studies/simulate/contact_times.h"
#include "studies/simulate/observed.h"

static void put_rows(kempe_table *table, const kempe_trajectory *t, const kmp_columns *columns, kmp_evaluator *eval,
                     double *values)
{
    kmp_tabulate_status(table, kmp_trajectory_word(t));
    for (int k = 0; k < columns->count; k++)
        kmp_tabulate_column(table, columns->unit[k], "%s", columns->name[k]);
    for (int row = 0; row < t->table.rows; row++) {
        kmp_columns_fill(&t->table, columns, eval, row, values);
        kmp_tabulate_row(table);
        kmp_tabulate_numbers(table, columns->count, values);
    }
}

static void fill_rows(kempe_table *table, const void *result)
{
    const kempe_trajectory *t = result;
    kmp_evaluator *eval = kmp_eval_new(t->system, t->backend);
    kmp_columns columns = {0};
    double *values =
        eval && kmp_columns_init(&columns, t->system, t->system->model, NULL) ? KMP_NEW(double, columns.count) : NULL;
    if (values)
        put_rows(table, t, &columns, eval, values);
    else
        kmp_tabulate_fail(table);
    kmp_columns_free(&columns);
    kmp_eval_free(eval);
    kmp_free(values);
}

static void fill_log(kempe_table *table, const void *result)
{
    const kmp_run_log *log = &((const kempe_trajectory *)result)->log;
    kmp_tabulate_columns(table, "t[s] kind[words] text[words] before after");
    for (int k = 0; k < log->kept; k++) {
        const kmp_log_entry *entry = &log->entries[k];
        kmp_tabulate_row(table);
        kmp_tabulate_cells(table, "%g %s %s %g %g", entry->t, entry->kind, entry->text, entry->before, entry->after);
    }
}

static void fill_contacts(kempe_table *table, const void *result)
{
    const kempe_trajectory *t = result;
    kmp_tabulate_columns(table, "contact[words] from[s] until[s] depth");
    for (int k = 0; k < t->log.contact_count; k++) {
        const kmp_contact_time *contact = &t->log.contacts[k];
        kmp_tabulate_row(table);
        kmp_tabulate_cells(table, "%s %g %g %g", t->system->model->forces[contact->force].name, contact->from,
                           contact->until, kmp_contact_time_depth(t, k));
    }
}

KMP_TABLES(kempe_trajectory, trajectory, trajectory->system->context, {"rows", fill_rows}, {"log", fill_log},
           {"contacts", fill_contacts})

/* -- outputs by name --------------------------------------------------------------------------------- */

kempe_status kempe_trajectory_outputs(const kempe_trajectory *trajectory, const char *names, kempe_table **table)
{
    KMP_WANTED(NULL, trajectory, "trajectory");
    kempe_context *context = trajectory->system->context;
    KMP_WANTED(context, names, "names");
    KMP_WANTED(context, table, "table");
    kmp_observed o;
    kmp_context_clear(context);
    KMP_TRY(kmp_observed_init(&o, trajectory->system, names, 0, NULL));
    kempe_table *made = kmp_tabulate(context, "outputs");
    double *values = KMP_NEW(double, o.columns.count);
    for (int c = 0; c < o.columns.count; c++)
        kmp_tabulate_column(made, o.columns.unit[c], "%s", o.columns.name[c]);
    for (int row = 0; values && row < trajectory->table.rows; row++) {
        kmp_observed_fill(&o, &trajectory->table, row, values);
        kmp_tabulate_row(made);
        kmp_tabulate_numbers(made, o.columns.count, values);
    }
    if (!values)
        kmp_tabulate_fail(made);
    kmp_free(values);
    kmp_observed_free(&o);
    return kmp_tabulate_finish(context, made, table);
}
