/* SPDX-License-Identifier: BSD-3-Clause */
/* `check` as tables. Of a mechanism that does not assemble most cells are unknown. */
#include "output/result_table.h"
#include "studies/assembly/check_print.h"
#include <math.h>

static void fill_mobility(kempe_table *table, const void *result)
{
    const kempe_check *check = result;
    const kmp_partition *part = &check->part;
    const kmp_diagnosis *d = &check->diagnosis;
    bool generic = d->moved || part->p == 0;
    kmp_tabulate_columns(table, "bodies coordinates closures rows rank dof driven generic_dof cond_Jv max_B margin");
    KMP_TABULATE(table, "%d %d %d %d", check->body_count, check->system->n, check->loop_count, check->system->m);
    if (check->assembled)
        kmp_tabulate_cells(table, "%d %d %d %g %g %g %g", part->r, part->p, check->driven,
                           generic ? (double)(part->n - d->generic_rank) : (double)NAN, check->condition, part->max_b,
                           d->margin);
}

static const kmp_alternative *alternative_of(const kempe_check *check, int coordinate)
{
    for (int k = 0; k < check->diagnosis.alternative_count; k++)
        if (check->diagnosis.alternatives[k].coordinate == coordinate)
            return &check->diagnosis.alternatives[k];
    return NULL;
}

static const char *role_of(const kmp_partition *part, int coordinate)
{
    for (int k = 0; k < part->p; k++)
        if (part->u[k] == coordinate)
            return "independent";
    return "dependent";
}

static void fill_coordinates(kempe_table *table, const void *result)
{
    const kempe_check *check = result;
    const kmp_limits *l = &check->diagnosis.limits;
    kmp_tabulate_columns(table, "coordinate[words] unit[words] role[words] instead_of[words] max_B low high turns "
                                "low_dead_centre high_dead_centre");
    for (int k = 0; k < check->system->n; k++) {
        const kmp_alternative *a = alternative_of(check, k);
        KMP_TABULATE(table, "%s %s %s %s %g", kmp_name_of_coordinate(check->system, k),
                     kmp_print_unit(check->system, k), check->assembled ? role_of(&check->part, k) : "",
                     a && a->instead >= 0 ? kmp_name_of_coordinate(check->system, a->instead) : "", a ? a->max_b : NAN);
        if (!check->assembled || !l->walked)
            continue;
        const kmp_swing *s = &l->swing[k];
        kmp_tabulate_cells(table, "%g %g %d %d %d", kmp_print_value(check->system, k, s->low),
                           kmp_print_value(check->system, k, s->high), s->turns, s->low_dead, s->high_dead);
    }
}

/* The number of rows of a closure, of all or of the redundant ones. */
static int count_rows(const kempe_check *check, int closure, bool redundant)
{
    const kmp_partition *part = &check->part;
    int count = 0;
    for (int k = 0; k < (redundant ? part->m - part->r : check->system->m); k++)
        count += check->system->rows[redundant ? part->redundant[k] : k].closure == closure;
    return count;
}

static void fill_closures(kempe_table *table, const void *result)
{
    const kempe_check *check = result;
    kmp_tabulate_columns(table, "closure[words] kind[words] rows redundant may_lose gap turn");
    for (int c = 0; c < check->loop_count; c++) {
        const kmp_diagnosis *d = &check->diagnosis;
        int may_lose = 0;
        for (int k = 0; check->assembled && k < d->repair_count; k++)
            may_lose = d->repairs[k].closure == c ? d->repairs[k].count : may_lose;
        KMP_TABULATE(table, "%s %s %d %g %g %g %g", kmp_name_of_closure(check->system, c),
                     check->system->model->closures[c].kind, count_rows(check, c, false),
                     check->assembled ? (double)count_rows(check, c, true) : (double)NAN,
                     check->assembled ? (double)may_lose : (double)NAN, check->assembly->gaps[c],
                     check->assembly->turns[c]);
    }
}

KMP_TABLES(kempe_check, check, check->system->context, {"mobility", fill_mobility}, {"coordinates", fill_coordinates},
           {"closures", fill_closures})
