/* SPDX-License-Identifier: BSD-3-Clause */
/* Evaluation of conditions, and their changes at the events that event_search.c has found. */
#include "integrators/run/events.h"
#include "base/memory.h"
#include "constraints/evaluation/condition_modes.h"
#include "constraints/evaluation/left_tables.h"
#include "constraints/tolerances.h"
#include "dynamics/kinematics/kinematics_conditions.h"
#include "dynamics/kinematics/link_tree.h"
#include "integrators/decide/restart.h"
#include "integrators/run/event_search.h"
#include "model/data/model.h"
#include "model/language/expression_value.h"
#include <math.h>
#include <string.h>

/* Changes of a condition with a lag count as simultaneous within this multiple of its lag. */
#define LAGS 100

void kmp_event_tracker_begin_past(const kempe_system *system, kmp_condition_past *past)
{
    for (int k = 0; k < system->events.count; k++)
        past[k] = (kmp_condition_past){.last = -INFINITY};
}

kmp_event_tracker *kmp_event_tracker_new(const kmp_event_setup *plan, kmp_arena *a)
{
    const kempe_system *system = plan->system;
    int n = system->n, count = system->events.count;
    kmp_event_tracker *c = KMP_ARENA_NEW(a, kmp_event_tracker, 1);
    if (!c)
        return NULL;
    *c = (kmp_event_tracker){.plan = *plan,
                             .s = system,
                             .eval = plan->eval,
                             .instant = KMP_EVENT_INSTANT * plan->span,
                             .kink = plan->kinks ? KMP_KINK_TOLERANCES * plan->rtol : 0,
                             .end = -1};
    c->kind = KMP_ARENA_NEW(a, int, count);
    for (int k = 0; c->kind && k < count; k++) {
        const kmp_condition *x = &system->events.condition[k];
        c->kind[k] = x->role == KMP_ROLE_SENSE || x->role == KMP_ROLE_HELD ? KMP_CONDITION_PASSES
                     : x->role != KMP_ROLE_NONE                            ? KMP_CONDITION_NUMBER
                     : x->told                                             ? KMP_CONDITION_TOLD
                     : x->kink                                             ? KMP_CONDITION_KINK
                     : x->ends                                             ? KMP_CONDITION_ENDS
                                                                           : KMP_CONDITION_SWITCHES;
        c->tells = c->tells || x->told;
    }
    c->stays = KMP_ARENA_NEW(a, bool, count);
    c->past = KMP_ARENA_NEW(a, kmp_condition_past, count);
    if (!KMP_ARENA_MAKE(a, KMP_ROOM(double, n, &c->q, &c->qd, &c->qdd), KMP_ROOM(double, system->m, &c->lambda),
                        KMP_ROOM(double, count, &c->change, &c->before)) ||
        !kmp_event_search_init(&c->search, system, plan->closely, a))
        return NULL;
    kmp_event_tracker_begin_past(system, c->past);
    kmp_event_tracker_take(c, plan->eval->mode, system->parameters, &plan->eval->inputs, c->past);
    return c;
}

/* -- evaluation ----------------------------------------------------------------------------------------- */

int kmp_event_tracker_first_end(const kmp_event_tracker *c)
{
    for (int k = 0; k < c->s->events.count; k++)
        if (c->s->events.condition[k].ends && kmp_event_tracker_changed(c, k))
            return k;
    return -1;
}

double kmp_event_tracker_shortens(const kmp_event_tracker *c, double from, double event, double to,
                                  kmp_repeated repeats)
{
    bool meets = false, ends = false;
    for (int k = 0; k < c->s->events.count; k++) {
        const kmp_condition *condition = &c->s->events.condition[k];
        const bool changed = kmp_event_tracker_changed(c, k);
        meets = meets || (changed && (condition->rough || (repeats == KMP_REPEATED_ALL && !condition->ends)));
        ends = ends || (changed && condition->measured && c->mode[k] > 0);
    }
    return kmp_restart_again(from, event, to, ends && repeats != KMP_REPEATED_ROUGH, meets);
}

/* True if condition k has changed and switches the equations. */
static bool has_switched(const kmp_event_tracker *c, int k)
{
    const kmp_condition *condition = &c->s->events.condition[k];
    return !condition->ends && condition->role == KMP_ROLE_NONE && !c->stays[k] && kmp_event_tracker_changed(c, k);
}

static int first_switched(const kmp_event_tracker *c)
{
    for (int k = 0; k < c->s->events.count; k++)
        if (has_switched(c, k))
            return k;
    return -1;
}

static kempe_status complete(kmp_event_tracker *c, double t, bool rates, bool again)
{
    KMP_TRY(c->plan.state(c->plan.user, t, rates, again, c->q, c->qd, c->qdd, c->lambda));
    kmp_eval_all_changes(c->eval, t, c->q, c->qd, c->qdd, c->lambda, c->change);
    return KEMPE_OK;
}

kempe_status kmp_event_tracker_look(kmp_event_tracker *c, double t)
{
    return complete(c, t, c->s->changes_by_rates, false);
}

/* Takes a value of a kink into account; true if it is free and due to be fixed. */
static bool is_away(kmp_event_tracker *c, int k, double change)
{
    return c->s->events.condition[k].kink && kmp_kink_is_away(c->mode[k], change, c->kink, &c->past[k].largest);
}

bool kmp_event_tracker_would_hold(kmp_event_tracker *c, const double *change)
{
    bool any = false;
    for (int k = 0; c->kink > 0 && k < c->s->events.count; k++)
        any = is_away(c, k, change[k]) || any;
    return any;
}

void kmp_event_tracker_hold_free(kmp_event_tracker *c, const double *before, const double *change)
{
    c->passed = false;
    for (int k = 0; c->kink > 0 && k < c->s->events.count; k++) {
        if (!is_away(c, k, change[k]))
            continue;
        if (before && kmp_kink_is_passed(before[k], change[k], c->kink, c->past[k].largest))
            c->passed = true;
        else
            kmp_eval_set_kink(c->eval, k, change[k] < 0 ? 1 : -1);
    }
}

/* True if the table of condition k has been reported, at either of its ends and calls. */
static bool is_told(const kmp_event_tracker *c, int k)
{
    const kmp_condition *condition = c->s->events.condition;
    for (int i = 0; i < c->s->events.count; i++)
        if (c->past[i].told && condition[i].expr->table == condition[k].expr->table)
            return true;
    return false;
}

void kmp_event_tracker_tell(kmp_event_tracker *c, double t, const double *change)
{
    for (int k = 0; k < c->s->events.count; k++) {
        const kmp_condition *condition = &c->s->events.condition[k];
        if (!condition->told || !(change[k] < 0))
            continue;
        atomic_store_explicit(&c->s->left[k], true, memory_order_relaxed);
        if (is_told(c, k))
            continue;
        const kmp_named_table *table = condition->expr->table;
        const int end = condition->number - kmp_table_end_number(table, 0);
        const double first = kmp_table_end(table, end - end % 2), last = kmp_table_end(table, end - end % 2 + 1);
        const double x = end % 2 ? last - change[k] : first + change[k];
        c->past[k].told = true;
        kmp_run_log_add(c->plan.log, "table", t, x, NAN, "table '%s' is used at %.6g, beyond its points %.6g .. %.6g",
                        table->name, x, first, last);
        kmp_doubt_table(c->s->context, table, end, x, t);
    }
}

kempe_status kmp_event_tracker_begin(kmp_event_tracker *c, double t, bool *ends)
{
    bool any = false;
    for (int k = 0; k < c->s->events.count; k++)
        any = any || c->s->events.condition[k].ends || c->s->events.condition[k].kink || c->s->events.condition[k].told;
    *ends = false;
    if (!any)
        return KEMPE_OK;
    KMP_TRY(kmp_event_tracker_look(c, t));
    kmp_event_tracker_hold_free(c, NULL, c->change);
    kmp_event_tracker_tell(c, t, c->change);
    c->end = kmp_event_tracker_first_end(c);
    *ends = c->end >= 0;
    return KEMPE_OK;
}

/* -- passing ----------------------------------------------------------------------------------------- */

/* Events are counted and named; bends are not. */
static void note_event(kmp_event_tracker *c, int k, double t, bool holds)
{
    const kmp_condition *condition = &c->s->events.condition[k];
    const kmp_expr *e = condition->expr;
    bool stated = !e || (e->kind != KMP_EXPR_AT_MOST && e->kind != KMP_EXPR_AT_LEAST);
    double most = condition->measured && !holds ? fmax(c->past[k].peak, c->past[k].most) : NAN;
    if (condition->bend || condition->rough)
        return;
    if (condition->measured) {
        const kmp_force *force = condition->of;
        kmp_run_log_contact(c->plan.log, (int)(force - c->s->model->forces), t, holds, most);
        c->past[k].peak = 0;
        c->past[k].latest.count = 0;
    }
    kmp_run_log_add(c->plan.log, "event", t, NAN, most, "%s became %s", c->s->event_text[k],
                    holds == stated ? "true" : "false");
    c->count++;
}

/* The branch of a kink follows the state if the kink is passed within the errors of steps, as at rest, or repeatedly.
 */
static kempe_status change_condition(kmp_event_tracker *c, int k, double t)
{
    const char *advice = c->s->events.condition[k].advice;
    const bool holds = !(c->mode[k] > 0), kink = c->s->events.condition[k].kink;
    kmp_condition_past *past = &c->past[k];
    c->search.ready = false;
    const double lag = c->s->events.condition[k].lag;
    const bool near = lag > 0 && past->most <= LAGS * lag;
    past->repeats = near || kmp_changes_at_once(t, past->last, c->instant) ? past->repeats + 1 : 0;
    if (kink) {
        const bool idle = kmp_kink_is_idle(past->most, c->kink, past->largest, past->repeats);
        kmp_eval_set_kink(c->eval, k, idle ? 0 : holds ? 1 : -1);
    } else {
        kmp_eval_set_mode(c->eval, k, holds);
        note_event(c, k, t, holds);
    }
    past->last = t;
    past->most = 0;
    if (kink || past->repeats < KMP_EVENT_REPEATS)
        return KEMPE_OK;
    c->stuck = true;
    return kmp_fail(
        c->s->context, KEMPE_E_FAILED, "%s changes back and forth at t = %.9g: %s", c->s->event_text[k], t,
        advice ? advice
               : "the motion slides along this condition; make the law continuous there, for instance with tanh");
}

/* Changes conditions. Conditions may depend on others, so that one change causes the next. */
static kempe_status change_conditions(kmp_event_tracker *c, double t)
{
    for (int pass = 0; pass < KMP_EVENT_REPEATS && first_switched(c) >= 0; pass++) {
        for (int k = 0; k < c->s->events.count; k++)
            if (has_switched(c, k))
                KMP_TRY(change_condition(c, k, t));
        memcpy(c->change, kmp_eval_changes(c->eval, t, c->q, c->qd), (size_t)c->s->events.count * sizeof(double));
    }
    int k = first_switched(c);
    return k < 0 ? KEMPE_OK
                 : kmp_fail(c->s->context, KEMPE_E_FAILED, "%s contradicts another condition at t = %.9g",
                            c->s->event_text[k], t);
}

kempe_status kmp_event_tracker_foresee(kmp_event_tracker *c, double t)
{
    KMP_TRY(kmp_event_tracker_look(c, t));
    memcpy(c->before, c->mode, (size_t)c->s->events.count * sizeof *c->mode);
    for (int pass = 0; pass < KMP_EVENT_REPEATS && first_switched(c) >= 0; pass++) {
        for (int k = 0; k < c->s->events.count; k++)
            if (has_switched(c, k))
                kmp_eval_set_mode(c->eval, k, !(c->mode[k] > 0));
        memcpy(c->change, kmp_eval_changes(c->eval, t, c->q, c->qd), (size_t)c->s->events.count * sizeof(double));
    }
    return KEMPE_OK;
}

void kmp_event_tracker_note(kmp_event_tracker *c, double t, const double *q, const double *qd)
{
    memcpy(c->before, kmp_eval_changes(c->eval, t, q, qd), (size_t)c->s->events.count * sizeof(double));
    c->noted = true;
}

kempe_status kmp_event_tracker_change(kmp_event_tracker *c, double t, const double *q, const double *qd, bool again,
                                      bool *changed)
{
    int count = c->s->events.count;
    c->search.ready = false;
    memcpy(c->q, q, (size_t)c->s->n * sizeof *q);
    memcpy(c->qd, qd, (size_t)c->s->n * sizeof *qd);
    memcpy(c->change, kmp_eval_changes(c->eval, t, q, qd), (size_t)count * sizeof(double));
    for (int k = 0; k < count; k++)
        c->stays[k] = (again && (c->stays[k] || c->past[k].last == t)) ||
                      (c->noted && c->past[k].last == t && c->change[k] == c->before[k]);
    *changed = first_switched(c) >= 0;
    kempe_status status = change_conditions(c, t);
    memset(c->stays, 0, c->noted || (again && !*changed) ? (size_t)count * sizeof *c->stays : 0);
    return status;
}

kempe_status kmp_event_tracker_pass(kmp_event_tracker *c, double t, bool rates)
{
    KMP_TRY(kmp_event_tracker_look(c, t));
    KMP_TRY(change_conditions(c, t));
    kempe_status status = rates ? complete(c, t, true, true) : KEMPE_OK; /* after the change */
    if (status == KEMPE_OK)
        kmp_event_tracker_hold_free(c, NULL, c->change); /* a step that follows the event may pass the kink */
    return status;
}
