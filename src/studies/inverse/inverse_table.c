/* SPDX-License-Identifier: BSD-3-Clause */
/* Inverse dynamics as a table. */
#include "dynamics/closures.h"
#include "output/result_table.h"
#include "studies/inverse/inverse.h"
#include <kempe/inverse.h>

/* Rows of drives have no multiplier. */
static bool has_multiplier(const kempe_system *s, int row)
{
    return !kmp_closure_is_drive(&s->model->closures[s->rows[row].closure]);
}

static void put_columns(kempe_table *table, const kempe_inverse *r)
{
    const kempe_model *model = r->system->model;
    kmp_tabulate_column(table, "s", "t");
    for (int k = 0; k < r->a; k++)
        kmp_tabulate_column(table, model->motions[r->actuator[k]].rotation ? "N m" : "N", "tau.%s",
                            model->motions[r->actuator[k]].name);
    for (int k = 0; k < r->a; k++)
        kmp_tabulate_column(table, "W", "power.%s", model->motions[r->actuator[k]].name);
    for (kmp_quantity quantity = KMP_QUANTITY_Q; quantity <= KMP_QUANTITY_QDD; quantity++)
        kmp_tabulate_quantity(table, r->system, quantity);
    for (int k = 0; k < r->m; k++)
        if (has_multiplier(r->system, k))
            kmp_tabulate_column(table, kmp_quantity_unit(r->system, KMP_QUANTITY_LAMBDA, k), "lambda.%s",
                                r->system->row_names[k]);
    for (int moment = 0; moment < 2; moment++)
        for (int k = 0; k < 3 * r->loops; k++)
            kmp_tabulate_column(table, moment ? "N m" : "N", "%s.%s.%c", moment ? "moment" : "reaction",
                                model->closures[r->loop[k / 3]].name, "xyz"[k % 3]);
}

static void put_row(kempe_table *table, const kempe_inverse *r, size_t row)
{
    size_t n = (size_t)r->n, a = (size_t)r->a, loops = (size_t)r->loops;
    const double *lambda = r->lambda + row * (size_t)r->m;
    kmp_tabulate_row(table);
    kmp_tabulate_number(table, r->t[row]);
    kmp_tabulate_numbers(table, r->a, r->tau + row * a);
    kmp_tabulate_numbers(table, r->a, r->power + row * a);
    kmp_tabulate_numbers(table, r->n, r->q + row * n);
    kmp_tabulate_numbers(table, r->n, r->qd + row * n);
    kmp_tabulate_numbers(table, r->n, r->qdd + row * n);
    for (int k = 0; k < r->m; k++)
        if (has_multiplier(r->system, k))
            kmp_tabulate_number(table, lambda[k]);
    for (size_t part = 0; part < KMP_REACTION; part += 3)
        for (size_t l = 0; l < loops; l++)
            kmp_tabulate_numbers(table, 3, r->reaction + (row * loops + l) * KMP_REACTION + part);
}

static void fill_rows(kempe_table *table, const void *result)
{
    const kempe_inverse *r = result;
    put_columns(table, r);
    for (size_t row = 0; row < (size_t)r->rows; row++)
        put_row(table, r, row);
}

kempe_status kempe_inverse_table(const kempe_inverse *inverse, const char *name, kempe_table **table)
{
    static const kmp_table_kind kinds[] = {{"rows", fill_rows}, {0}};
    KMP_WANTED(NULL, inverse, "inverse");
    return kmp_tabulate_result(inverse->system->context, kinds, inverse, name, table);
}
