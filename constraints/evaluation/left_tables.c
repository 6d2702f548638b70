/* SPDX-License-Identifier: BSD-3-Clause */
/* Tables that a state leaves: values beyond the first or last point of a table are extrapolated, which a result must
 * admit. Laws and closures have a condition for each end of a table; outputs have the argument of each use among
 * their values. A table is doubted once for an evaluator. */
#include "constraints/evaluation/left_tables.h"
#include "constraints/evaluation/evaluator.h"
#include "dynamics/kinematics/kinematics_conditions.h"
#include "model/data/model.h"
#include "model/data/output_table.h"
#include "model/language/expression_value.h"
#include <string.h>

struct kmp_left_tables {
    bool *told;     /* of each table of the model: it has been doubted */
    double *change; /* of each condition at the last kmp_eval_leaves */
};

kmp_left_tables *kmp_left_tables_new(const kempe_system *system, kmp_arena *arena)
{
    kmp_left_tables *left = KMP_ARENA_NEW(arena, kmp_left_tables, 1);
    return left && KMP_ARENA_MAKE(arena, KMP_ROOM(bool, system->model->table_count, &left->told),
                                  KMP_ROOM(double, system->events.count, &left->change))
               ? left
               : NULL;
}

const char *kmp_table_advice(const kmp_named_table *table)
{
    return table->outside == KMP_OUTSIDE_ERROR ? "give it more points; 'outside: error' ends a run where forces and "
                                                 "constraints use the table, not sensors"
                                               : "give it more points, or say outside: linear, hold or error";
}

void kmp_doubt_table(kempe_context *context, const kmp_named_table *table, int end, double x, double t)
{
    kmp_doubt(context, KMP_TABLE_LEFT, table->name, x, kmp_table_end(table, end - end % 2),
              kmp_table_end(table, end - end % 2 + 1), t, kmp_table_advice(table));
}

void kmp_eval_tell_table(kmp_evaluator *eval, const kmp_named_table *table, int end, double x, double t)
{
    bool *told = &eval->left_tables->told[table - eval->system->model->tables];
    if (!*told)
        kmp_doubt_table(eval->system->context, table, end, x, t);
    *told = true;
}

int kmp_eval_left(const kempe_system *s, const double *shown, int k, double *x)
{
    const kmp_named_table *table = &s->model->tables[s->use[k].table];
    const int first = 2 * s->use[k].variable;
    *x = shown[kmp_outputs_width(s->model) + k];
    return *x < kmp_table_end(table, first) ? first : *x > kmp_table_end(table, first + 1) ? first + 1 : -1;
}

void kmp_eval_tell_shown(kmp_evaluator *eval, double t, const double *shown)
{
    for (int k = 0; k < eval->system->use_count; k++) {
        double x;
        int end = kmp_eval_left(eval->system, shown, k, &x);
        if (end >= 0)
            kmp_eval_tell_table(eval, &eval->system->model->tables[eval->system->use[k].table], end, x, t);
    }
}

bool kmp_eval_leaves(kmp_evaluator *eval, double t, const double *q, const double *qd, const double *qdd,
                     const double *lambda)
{
    const kmp_events *events = &eval->system->events;
    for (int k = 0; k < events->count; k++)
        if (events->condition[k].told) {
            if (qdd)
                kmp_eval_all_changes(eval, t, q, qd, qdd, lambda, eval->left_tables->change);
            else
                memcpy(eval->left_tables->change, kmp_eval_changes(eval, t, q, qd),
                       (size_t)events->count * sizeof(double));
            return true;
        }
    return false;
}

const kmp_named_table *kmp_eval_next_left(const kmp_evaluator *eval, int *from, int *end, double *x)
{
    const kmp_events *events = &eval->system->events;
    while (*from < events->count) {
        const kmp_condition *c = &events->condition[*from];
        const double change = eval->left_tables->change[(*from)++];
        if (!c->told || !(change < 0))
            continue;
        *end = c->number - kmp_table_end_number(c->expr->table, 0);
        *x = kmp_table_end(c->expr->table, *end) + (*end % 2 ? -change : change);
        return c->expr->table;
    }
    return NULL;
}
