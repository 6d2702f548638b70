/* SPDX-License-Identifier: BSD-3-Clause */
#include "analyses/parts/told_tables.h"
#include "constraints/evaluation/left_tables.h"
#include "model/data/model.h"
#include "model/language/expression_value.h"

typedef struct table_use {
    const kempe_model *model;
    const kmp_expr *part;
} table_use;

/* Also under a name, or in the equations of implicit variables. */
static bool has_part(const kmp_expr *e, const void *user)
{
    const table_use *use = user;
    const kmp_unknowns *u = e->kind == KMP_EXPR_UNKNOWN ? &use->model->unknowns[e->index] : NULL;
    bool found = e == use->part;
    for (int k = 0; u && !found && k < (u->count > 0 ? u->count : 1); k++)
        found = kmp_expr_find(u->zero[k], has_part, user);
    return found;
}

static bool is_used_in_closures(const kempe_model *model, const kmp_expr *part)
{
    const table_use use = {model, part};
    for (int k = 0; k < model->closure_count; k++) {
        const kmp_closure *c = &model->closures[k];
        if (kmp_expr_find(c->function, has_part, &use) || kmp_expr_find(c->curve[0], has_part, &use) ||
            kmp_expr_find(c->curve[1], has_part, &use))
            return true;
    }
    return false;
}

void kmp_eval_tell_tables(kmp_evaluator *eval, double t, const double *q, const double *qd, const double *qdd,
                          const double *lambda, bool forces, const double *shown)
{
    int k = kmp_eval_leaves(eval, t, q, qd, qdd, lambda) ? 0 : eval->system->events.count, end;
    double x;
    for (const kmp_named_table *left; (left = kmp_eval_next_left(eval, &k, &end, &x));)
        if (forces || is_used_in_closures(eval->system->model, eval->system->events.condition[k - 1].expr))
            kmp_eval_tell_table(eval, left, end, x, t);
    if (shown)
        kmp_eval_tell_shown(eval, t, shown);
}
