/* SPDX-License-Identifier: BSD-3-Clause */
/* Equilibria as tables. */
#include "output/print.h"
#include "output/result_table.h"
#include "studies/equilibrium/balances.h"
#include <kempe/equilibrium.h>
#include <math.h>

static void fill_equilibria(kempe_table *table, const void *result)
{
    const kempe_equilibrium *e = result;
    const kempe_system *s = e->system;
    kmp_tabulate_status(table, kmp_status_word(e->status));
    kmp_tabulate_columns(table, "stability[words] residual potential[J] hits");
    for (int k = 0; k < e->freed_count; k++)
        kmp_tabulate_column(table, e->freed_unit[k], "%s", e->freed_name[k]);
    kmp_tabulate_quantity(table, s, KMP_QUANTITY_Q);
    kmp_tabulate_quantity(table, s, KMP_QUANTITY_QD);
    kmp_tabulate_quantity(table, s, KMP_QUANTITY_LAMBDA);
    for (int i = 0; i < e->rate_count; i++)
        if (e->rates[i].how == KMP_RATE_HELD)
            kmp_tabulate_column(table, s->model->motions[e->rates[i].coordinate].rotation ? "N m" : "N", "load.%s",
                                s->model->motions[e->rates[i].coordinate].name);
    for (const kmp_balance *b = e->balance; b < e->balance + e->count; b++) {
        kmp_tabulate_row(table);
        kmp_tabulate_cells(table, "%s %g %g %d", kmp_stability_text(b->stability.word), b->residual, b->potential,
                           b->hits);
        kmp_tabulate_numbers(table, e->freed_count, b->freed);
        kmp_tabulate_values(table, s, KMP_QUANTITY_Q, b->q);
        kmp_tabulate_values(table, s, KMP_QUANTITY_QD, b->qd);
        kmp_tabulate_numbers(table, s->m, b->lambda);
        for (int i = 0; i < e->rate_count; i++)
            if (e->rates[i].how == KMP_RATE_HELD)
                kmp_tabulate_number(table, e->rates[i].load);
    }
}

static void fill_history(kempe_table *table, const void *result)
{
    const kempe_equilibrium *e = result;
    kmp_tabulate_columns(table, "equilibrium iteration residual step");
    for (int k = 0; k < e->count; k++)
        for (int i = 0; i < e->balance[k].iterations; i++) {
            kmp_tabulate_row(table);
            kmp_tabulate_cells(table, "%d %d %g %g", k, i, e->balance[k].residuals[i], e->balance[k].steps[i]);
        }
}

static void fill_friction(kempe_table *table, const void *result)
{
    const kempe_equilibrium *e = result;
    kmp_tabulate_columns(table, "equilibrium element[words] force largest part");
    for (int k = 0; k < e->count; k++)
        for (int i = 0; i < e->balance[k].friction_count; i++) {
            const kmp_friction_view *view = &e->balance[k].friction[i];
            kmp_tabulate_row(table);
            kmp_tabulate_cells(table, "%d %s %g %g %g", k, view->element->name, view->force, view->largest,
                               view->largest > 0 ? view->needs / view->largest : NAN);
        }
}

static void fill_contacts(kempe_table *table, const void *result)
{
    const kempe_equilibrium *e = result;
    kmp_tabulate_columns(table, "equilibrium contact[words] gap force word[words]");
    for (int k = 0; k < e->count; k++)
        for (int i = 0; i < e->balance[k].contact_count; i++) {
            const kmp_balance_contact *c = &e->balance[k].contact[i];
            kmp_tabulate_row(table);
            kmp_tabulate_cells(table, "%d %s %g %g %s", k, c->element->name, c->gap, c->force,
                               kmp_contact_text(c->word));
        }
}

static void fill_rest(kempe_table *table, const void *result)
{
    const kempe_equilibrium *e = result;
    const kempe_system *s = e->system;
    kmp_tabulate_columns(table, "equilibrium element[words] coordinate[words] value end[words]");
    kmp_tabulate_quantity(table, s, KMP_QUANTITY_Q);
    for (int k = 0; k < e->count; k++)
        for (int i = 0; i < 2 * e->balance[k].set_count; i++) {
            const kmp_rest_set *set = &e->balance[k].set[i / 2];
            const kmp_rest_end *end = &set->end[i % 2];
            kmp_tabulate_row(table);
            kmp_tabulate_cells(table, "%d %s %s %g %s", k, set->element->name, s->model->motions[set->coordinate].name,
                               end->q[set->coordinate], kmp_rest_text(end->word));
            kmp_tabulate_values(table, s, KMP_QUANTITY_Q, end->q);
        }
}

KMP_TABLES(kempe_equilibrium, equilibrium, equilibrium->requested->context, {"equilibria", fill_equilibria},
           {"contacts", fill_contacts}, {"friction", fill_friction}, {"rest", fill_rest}, {"history", fill_history})
