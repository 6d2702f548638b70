/* SPDX-License-Identifier: BSD-3-Clause */
/* Equilibria as tables. */
#include "output/result_table.h"
#include "studies/equilibrium/balances.h"
#include <kempe/equilibrium.h>

static void fill_equilibria(kempe_table *table, const void *result)
{
    const kempe_equilibrium *e = result;
    const kempe_system *s = e->system;
    kmp_tabulate_columns(table, "stability[words] residual potential[J] hits");
    for (int k = 0; k < e->freed_count; k++)
        kmp_tabulate_column(table, e->freed_unit[k], "%s", e->freed_name[k]);
    kmp_tabulate_quantity(table, s, KMP_QUANTITY_Q);
    kmp_tabulate_quantity(table, s, KMP_QUANTITY_QD);
    kmp_tabulate_quantity(table, s, KMP_QUANTITY_LAMBDA);
    for (const kmp_balance *b = e->balance; b < e->balance + e->count; b++) {
        kmp_tabulate_row(table);
        kmp_tabulate_cells(table, "%s %g %g %d", kmp_stability_text(b->stability.word), b->residual, b->potential,
                           b->hits);
        kmp_tabulate_numbers(table, e->freed_count, b->freed);
        kmp_tabulate_values(table, s, KMP_QUANTITY_Q, b->q);
        kmp_tabulate_values(table, s, KMP_QUANTITY_QD, b->qd);
        kmp_tabulate_numbers(table, s->m, b->lambda);
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

KMP_TABLES(kempe_equilibrium, equilibrium, equilibrium->requested->context, {"equilibria", fill_equilibria},
           {"history", fill_history})
