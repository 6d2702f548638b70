/* SPDX-License-Identifier: BSD-3-Clause */
/* Evaluation of conditions, and their changes at the events that event_search.c has found. */
#include "integrators/run/runner.h"
#include <float.h>
#include <math.h>
#include <string.h>

enum { MOST_REPEATS = 20 }; /* changes of one condition without time between them */

/* Part of a run: changes of one condition within it count as simultaneous. */
#define INSTANT 1e-11
/* Changes of a condition with a lag count as simultaneous within this multiple of its lag. */
#define LAGS 100
/* A kink is fixed beyond this many tolerances of its largest value: within them the errors of steps exceed its
 * effect. */
#define KINK 100

kmp_crossing *kmp_crossing_new(kmp_runner *run)
{
    const kempe_system *system = run->s;
    int n = system->n, count = system->events.count;
    double span = run->spec.t_end - run->spec.t_start;
    bool passes_kinks = run->kind->corrects && !run->spec.kind;
    kmp_arena *a = &run->arena;
    kmp_crossing *c = KMP_ARENA_NEW(a, kmp_crossing, 1);
    if (!c)
        return NULL;
    *c = (kmp_crossing){.run = run,
                        .s = system,
                        .eval = run->eval,
                        .instant = INSTANT * span,
                        .kink = passes_kinks ? KINK * run->spec.rtol : 0,
                        .end = -1};
    c->repeats = KMP_ARENA_NEW(a, int, count);
    c->stays = KMP_ARENA_NEW(a, bool, count);
    if (!KMP_ARENA_MAKE(a, KMP_ROOM(double, n, &c->q, &c->qd, &c->qdd), KMP_ROOM(double, system->m, &c->lambda),
                        KMP_ROOM(double, count, &c->change, &c->last, &c->most, &c->largest, &c->peak),
                        KMP_ROOM(kmp_last_values, count, &c->latest)) ||
        !kmp_event_search_init(&c->search, system, run->spec.closely, a))
        return NULL;
    for (int k = 0; k < count; k++)
        c->last[k] = -INFINITY;
    return c;
}

/* -- evaluation ----------------------------------------------------------------------------------------- */

int kmp_crossing_first_end(const kmp_crossing *c)
{
    for (int k = 0; k < c->s->events.count; k++)
        if (c->s->events.condition[k].ends && kmp_crossing_changed(c, k))
            return k;
    return -1;
}

bool kmp_crossing_meets_kink(const kmp_crossing *c)
{
    for (int k = 0; k < c->s->events.count; k++)
        if (c->s->events.condition[k].measured && c->eval->mode[k] > 0 && kmp_crossing_changed(c, k))
            return true;
    return false;
}

/* True if condition k has changed and switches the equations. */
static bool has_switched(const kmp_crossing *c, int k)
{
    const kmp_condition *condition = &c->s->events.condition[k];
    return !condition->ends && condition->role == KMP_ROLE_NONE && !c->stays[k] && kmp_crossing_changed(c, k);
}

static int first_switched(const kmp_crossing *c)
{
    for (int k = 0; k < c->s->events.count; k++)
        if (has_switched(c, k))
            return k;
    return -1;
}

kempe_status kmp_crossing_complete(kmp_crossing *c, double t, bool whole)
{
    double *qdd = whole || c->s->changes_by_rates ? c->qdd : NULL, work;
    kmp_formulation *formulation = c->run->formulation;
    if (formulation->row(formulation, t, c->run->y, c->q, c->qd, qdd, c->lambda, &work) != KMP_GO)
        return KEMPE_E_FAILED;
    kmp_eval_all_changes(c->eval, t, c->q, c->qd, c->qdd, c->lambda, c->change);
    return KEMPE_OK;
}

kempe_status kmp_crossing_look(kmp_crossing *c, double t)
{
    KMP_TRY(c->run->kind->dense(c->run->solver, t, c->run->y, c->run->yp));
    return kmp_crossing_complete(c, t, false);
}

void kmp_crossing_hold_free(kmp_crossing *c, const double *change)
{
    for (int k = 0; c->kink > 0 && k < c->s->events.count; k++) {
        if (!c->s->events.condition[k].kink)
            continue;
        c->largest[k] = fmax(c->largest[k], fabs(change[k]));
        if (kmp_crossing_is_free(c, k) && fabs(change[k]) > 2 * c->kink * c->largest[k])
            kmp_eval_set_kink(c->eval, k, change[k] < 0 ? 1 : -1);
    }
}

kempe_status kmp_crossing_begin(kmp_crossing *c, double t, bool *ends)
{
    bool any = false;
    for (int k = 0; k < c->s->events.count; k++)
        any = any || c->s->events.condition[k].ends || c->s->events.condition[k].kink;
    *ends = false;
    if (!any)
        return KEMPE_OK;
    KMP_TRY(kmp_crossing_look(c, t));
    kmp_crossing_hold_free(c, c->change);
    c->end = kmp_crossing_first_end(c);
    *ends = c->end >= 0;
    return KEMPE_OK;
}

/* -- passing ----------------------------------------------------------------------------------------- */

/* True if condition k, which changes at t, has also changed a moment before. */
static bool just_changed(const kmp_crossing *c, int k, double t)
{
    double lag = c->s->events.condition[k].lag;
    bool near = lag > 0 && c->most[k] <= LAGS * lag;
    return near || t - c->last[k] <= fmax(64 * DBL_EPSILON * fabs(t), c->instant);
}

/* Continues with the other branch of a kink. Its branch follows the state if the kink is passed within the errors of
 * steps, as at rest, or repeatedly. */
static void change_branch(kmp_crossing *c, int k, double t)
{
    c->repeats[k] = just_changed(c, k, t) ? c->repeats[k] + 1 : 0;
    bool idle = c->most[k] <= c->kink * c->largest[k] || c->repeats[k] >= MOST_REPEATS;
    c->last[k] = t;
    c->most[k] = 0;
    kmp_eval_set_kink(c->eval, k, idle ? 0 : c->eval->mode[k] > 0 ? -1 : 1);
}

static void note_contact(kmp_crossing *c, int k, double t, bool begins, double most)
{
    const kmp_force *force = c->s->events.condition[k].of;
    kmp_run_log_contact(c->run->log, (int)(force - c->s->model->forces), t, begins, most);
    c->peak[k] = 0;
    c->latest[k].count = 0;
}

static kempe_status change_condition(kmp_crossing *c, int k, double t)
{
    const char *advice = c->s->events.condition[k].advice;
    bool holds = !(c->eval->mode[k] > 0);
    c->search.ready = false;
    if (c->s->events.condition[k].kink) {
        change_branch(c, k, t);
        return KEMPE_OK;
    }
    const kmp_expr *e = c->s->events.condition[k].expr;
    bool stated = !e || (e->kind != KMP_EXPR_AT_MOST && e->kind != KMP_EXPR_AT_LEAST);
    kmp_eval_set_mode(c->eval, k, holds);
    const bool measured = c->s->events.condition[k].measured;
    double most = measured && !holds ? fmax(c->peak[k], c->most[k]) : NAN;
    if (measured)
        note_contact(c, k, t, holds, most);
    kmp_run_log_add(c->run->log, "event", t, NAN, most, "%s became %s", c->s->event_text[k],
                    holds == stated ? "true" : "false");
    c->count++;
    c->repeats[k] = just_changed(c, k, t) ? c->repeats[k] + 1 : 0;
    c->last[k] = t;
    c->most[k] = 0;
    if (c->repeats[k] < MOST_REPEATS)
        return KEMPE_OK;
    c->stuck = true;
    return kmp_fail(
        c->s->context, KEMPE_E_FAILED, "%s changes back and forth at t = %.9g: %s", c->s->event_text[k], t,
        advice ? advice
               : "the motion slides along this condition; make the law continuous there, for instance with tanh");
}

/* Changes conditions. Conditions may depend on others, so that one change causes the next. */
static kempe_status change_conditions(kmp_crossing *c, double t)
{
    for (int pass = 0; pass < MOST_REPEATS && first_switched(c) >= 0; pass++) {
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

kempe_status kmp_crossing_change(kmp_crossing *c, double t, const double *q, const double *qd, bool again,
                                 bool *changed)
{
    int count = c->s->events.count;
    c->search.ready = false;
    memcpy(c->q, q, (size_t)c->s->n * sizeof *q);
    memcpy(c->qd, qd, (size_t)c->s->n * sizeof *qd);
    memcpy(c->change, kmp_eval_changes(c->eval, t, q, qd), (size_t)count * sizeof(double));
    for (int k = 0; k < count; k++)
        c->stays[k] = again && (c->stays[k] || c->last[k] == t);
    *changed = first_switched(c) >= 0;
    kempe_status status = change_conditions(c, t);
    memset(c->stays, 0, again && !*changed ? (size_t)count * sizeof *c->stays : 0);
    return status;
}

kempe_status kmp_crossing_pass(kmp_crossing *c, double t)
{
    kmp_formulation *formulation = c->run->formulation;
    KMP_TRY(kmp_crossing_look(c, t));
    KMP_TRY(change_conditions(c, t));
    KMP_TRY(kmp_crossing_complete(c, t, true)); /* accelerations and multipliers after the change */
    return formulation->resume(formulation, t, c->q, c->qd, c->run->y, c->run->yp) == KMP_GO ? KEMPE_OK
                                                                                             : KEMPE_E_FAILED;
}
