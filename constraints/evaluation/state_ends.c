/* SPDX-License-Identifier: BSD-3-Clause */
#include "constraints/evaluation/state_ends.h"
#include "base/context.h"
#include "base/text.h"
#include "model/data/model.h"
#include "model/language/expression_value.h"
#include <math.h>
#include <string.h>

struct kmp_state_ends {
    bool *reported; /* of each condition: the result has a warning of it */
    double *change; /* of each condition at the last state */
};

kmp_state_ends *kmp_state_ends_new(const kempe_system *system, kmp_arena *arena)
{
    kmp_state_ends *ends = KMP_ARENA_NEW(arena, kmp_state_ends, 1);
    return ends && KMP_ARENA_MAKE(arena, KMP_ROOM(bool, system->events.count, &ends->reported),
                                  KMP_ROOM(double, system->events.count, &ends->change))
               ? ends
               : NULL;
}

double kmp_eval_row_time(kmp_evaluator *eval, double t, const double *q, const double *qd)
{
    const double before = t - KMP_BEFORE_EVENT * fabs(t), *change = t > 0 ? kmp_eval_changes(eval, t, q, qd) : NULL;
    const int count = change ? eval->system->events.count : 0;
    bool changes = false;
    if (count > 0)
        memcpy(eval->state_ends->change, change, (size_t)count * sizeof *change);
    change = count > 0 ? kmp_eval_changes(eval, before, q, qd) : NULL;
    for (int k = 0; k < count && !changes; k++)
        changes = (change[k] < 0) != (eval->state_ends->change[k] < 0);
    return changes ? before : t;
}

void kmp_put_end(kmp_text *text, const kempe_system *system, int condition, double t)
{
    const char *advice = system->events.condition[condition].advice;
    kmp_text_printf(text, "%s at t = %.9g s%s%s", system->event_text[condition], t, advice ? ": " : "",
                    advice ? advice : "");
}

typedef struct expression_part {
    const kempe_model *model;
    const kmp_expr *part;
} expression_part;

/* Also under a name, or in the equations of implicit variables. */
static bool has_part(const kmp_expr *e, const void *user)
{
    const expression_part *within = user;
    const kmp_unknowns *u = e->kind == KMP_EXPR_UNKNOWN ? &within->model->unknowns[e->index] : NULL;
    bool found = e == within->part;
    for (int k = 0; u && !found && k < (u->count > 0 ? u->count : 1); k++)
        found = kmp_expr_find(u->zero[k], has_part, user);
    return found;
}

bool kmp_is_in_closures(const kempe_model *model, const kmp_expr *part)
{
    const expression_part within = {model, part};
    for (int k = 0; k < model->closure_count; k++) {
        const kmp_closure *c = &model->closures[k];
        if (kmp_expr_find(c->function, has_part, &within) || kmp_expr_find(c->curve[0], has_part, &within) ||
            kmp_expr_find(c->curve[1], has_part, &within))
            return true;
    }
    return false;
}

/* True for a condition of positions: of a closure, or of an element other than a force. */
static bool is_of_places(const kempe_model *model, const kmp_condition *c)
{
    bool of_force = false;
    for (int k = 0; k < model->force_count && !c->expr; k++)
        of_force = of_force || c->of == &model->forces[k];
    return c->expr ? kmp_is_in_closures(model, c->expr) : !of_force && !c->late;
}

int kmp_eval_next_end(kmp_evaluator *eval, kmp_ends_judged judged, double t, const double *q, const double *qd,
                      const double *qdd, const double *lambda, int *from)
{
    const kmp_events *events = &eval->system->events;
    const double *change = NULL;
    for (; eval->conditions.machine && *from < events->count; ++*from) {
        const kmp_condition *c = &events->condition[*from];
        if (!c->ends || (c->late && !qdd) || (judged != KMP_ENDS_OF_RUN && !c->advice) ||
            (judged == KMP_ENDS_OF_PLACES && !is_of_places(eval->system->model, c)))
            continue;
        if (!change && qdd)
            kmp_eval_all_changes(eval, t, q, qd, qdd, lambda, eval->state_ends->change);
        if (!change)
            change = qdd ? eval->state_ends->change : kmp_eval_changes(eval, t, q, qd);
        if (change[*from] < 0)
            return (*from)++;
    }
    return -1;
}

void kmp_eval_doubt_ends(kmp_evaluator *eval, kmp_ends_judged judged, double t, const double *q, const double *qd,
                         const double *qdd, const double *lambda)
{
    int from = 0;
    for (int k; (k = kmp_eval_next_end(eval, judged, t, q, qd, qdd, lambda, &from)) >= 0;) {
        if (eval->state_ends->reported[k])
            continue;
        kmp_text text = {0};
        kmp_put_end(&text, eval->system, k, t);
        kmp_doubt(eval->system->context, KMP_RUN_WOULD_END, text.s ? text.s : "");
        kmp_text_free(&text);
        eval->state_ends->reported[k] = true;
    }
}
