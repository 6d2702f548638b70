/* SPDX-License-Identifier: BSD-3-Clause */
/* A sweep as tables. */
#include "model/tables/output_table.h"
#include "output/print.h"
#include "output/result_table.h"
#include "studies/kinematics/position_sweep.h"
#include <kempe/kinematics.h>

static void fill_rows(kempe_table *table, const void *result)
{
    const kempe_kinematics *k = result;
    const kempe_system *s = k->system;
    kmp_tabulate_status(table, kmp_status_word(k->status));
    kmp_tabulate_columns(table, "s t[s]");
    for (kmp_quantity quantity = KMP_QUANTITY_Q; quantity <= KMP_QUANTITY_QDD; quantity++)
        kmp_tabulate_quantity(table, s, quantity);
    for (int c = 0; c < k->width; c++)
        kmp_tabulate_column(table,
                            kmp_output_unit(s->model, &s->model->outputs[k->column[c].output], k->column[c].component),
                            "%s", k->column[c].name);
    for (int row = 0; row < k->count; row++) {
        ptrdiff_t at = (ptrdiff_t)row * s->n;
        KMP_TABULATE(table, "%g %g", k->s[row],
                     k->time < 0 ? k->s[row] / k->rate : kmp_lead_value(&k->lead[k->time], k->s[row]));
        kmp_tabulate_values(table, s, KMP_QUANTITY_Q, k->q + at);
        kmp_tabulate_values(table, s, KMP_QUANTITY_QD, k->qd + at);
        kmp_tabulate_values(table, s, KMP_QUANTITY_QDD, k->qdd + at);
        kmp_tabulate_numbers(table, k->width, k->shown + (ptrdiff_t)row * k->width);
    }
}

static void fill_dead_centres(kempe_table *table, const void *result)
{
    const kempe_kinematics *k = result;
    const kmp_lead *lead = &k->lead[k->first];
    kmp_tabulate_columns(table, "s coordinate[words]");
    kmp_tabulate_column(table, kmp_kinematics_unit(k, lead), "value");
    kmp_tabulate_columns(table, "extreme[words] determined margin instead[words]");
    kmp_tabulate_quantity(table, k->system, KMP_QUANTITY_Q);
    for (const kmp_dead_centre *dead = k->dead; dead < k->dead + k->dead_count; dead++) {
        KMP_TABULATE(table, "%g %s %g %s %g %g %s", dead->s, kmp_kinematics_name(k, lead), dead->value,
                     dead->largest ? "greatest" : "least", dead->determined, dead->margin, dead->instead);
        kmp_tabulate_values(table, k->system, KMP_QUANTITY_Q, dead->q);
    }
}

static void fill_change_points(kempe_table *table, const void *result)
{
    const kempe_kinematics *k = result;
    const kmp_lead *lead = &k->lead[k->first];
    kmp_tabulate_columns(table, "s");
    kmp_tabulate_column(table, kmp_kinematics_unit(k, lead), "value");
    kmp_tabulate_columns(table, "margin");
    kmp_tabulate_quantity(table, k->system, KMP_QUANTITY_Q);
    for (const kmp_change_point *change = k->change; change < k->change + k->change_count; change++) {
        KMP_TABULATE(table, "%g %g %g", change->s, kmp_lead_value(lead, change->s), change->margin);
        kmp_tabulate_values(table, k->system, KMP_QUANTITY_Q, change->q);
    }
}

KMP_TABLES(kempe_kinematics, kinematics, kinematics->system->context, {"rows", fill_rows},
           {"dead_centres", fill_dead_centres}, {"change_points", fill_change_points})
