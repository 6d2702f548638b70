/* SPDX-License-Identifier: BSD-3-Clause */
/* Inverse dynamics as a table. */
#include "output/result_table.h"
#include "studies/inverse/inverse_study.h"
#include <kempe/inverse.h>

static void fill_rows(kempe_table *table, const void *result)
{
    const kempe_inverse *r = result;
    const kempe_model *model = r->system->model;
    kmp_tabulate_status(table, kempe_inverse_status(r));
    kmp_tabulate_columns(table, "t[s]");
    for (int k = 0; k < r->a; k++)
        kmp_tabulate_column(table, model->motions[r->actuator[k]].rotation ? "N m" : "N", "tau.%s",
                            model->motions[r->actuator[k]].name);
    for (int k = 0; k < r->a; k++)
        kmp_tabulate_column(table, "W", "power.%s", model->motions[r->actuator[k]].name);
    for (kmp_quantity quantity = KMP_QUANTITY_Q; quantity <= KMP_QUANTITY_QDD; quantity++)
        kmp_tabulate_quantity(table, r->system, quantity);
    for (int k = 0; k < r->m; k++) /* drives have no multipliers */
        if (!kmp_closure_is_drive(&model->closures[r->system->rows[k].closure]))
            kmp_tabulate_column(table, kmp_quantity_unit(r->system, KMP_QUANTITY_LAMBDA, k), "lambda.%s",
                                r->system->row_names[k]);
    for (int moment = 0; moment < 2; moment++)
        for (int k = 0; k < 3 * (r->loops + r->joints); k++)
            kmp_tabulate_column(table, moment ? "N m" : "N", "%s.%s.%c", moment ? "moment" : "reaction",
                                kmp_inverse_load_name(r, k / 3), "xyz"[k % 3]);
    for (int row = 0; row < r->rows; row++) {
        kmp_tabulate_row(table);
        kmp_tabulate_number(table, r->t[row]);
        kmp_tabulate_numbers(table, r->width, kmp_inverse_part(r, row, 0));
    }
}

KMP_TABLES(kempe_inverse, inverse, inverse->system->context, {"rows", fill_rows})
