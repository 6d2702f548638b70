/* SPDX-License-Identifier: BSD-3-Clause */
/* Conditions are compared with what is held at a few points of each step; the first interval in which one has changed
 * is narrowed by regula falsi (Illinois), with bisection where that is slow, on dense output. */
#include "integrators/events.h"
#include "base/memory.h"
#include <float.h>
#include <math.h>
#include <string.h>

enum {
    POINTS = 4, /* of a step that are looked at, its end included */
    MOST_ITERATIONS = 200,
    MOST_REPEATS = 20 /* changes of one condition with no time between */
};

/* Part of a run: changes of one condition that follow each other within it leave no time between. */
#define INSTANT 1e-11
/* Nor do those of a condition with a lag whose value stays within so many of it. */
#define LAGS 100

struct kmp_crossing {
    const kempe_system *s;
    kmp_plant *plant;
    kmp_road *road;
    const kmp_solver_kind *kind;
    void *solver;
    double *y, *yp, *q, *qd, *qdd, *lambda;
    double work;
    double *change; /* first - second at the last point that was looked at */
    double *last;   /* time of the last change of each condition */
    double *most;   /* the largest value of each since then, of what was looked at */
    int *repeats;
    bool stuck;     /* one changed back and forth */
    bool *stays;    /* of each condition: it is not looked at until the next event */
    double instant; /* of the run: nothing that moves does so in less */
    long count;
    int end; /* the condition that ends the run there; -1: none */
    kmp_journal *journal;
};

bool kmp_crossing_move(kmp_crossing *c, kmp_road *road, const kmp_solver_kind *kind, void *solver)
{
    int n = c->s->n;
    double *y = KMP_NEW(double, 2 * road->size + 3 * n + c->s->m);
    if (!y)
        return false;
    kmp_free(c->y);
    c->road = road;
    c->kind = kind;
    c->solver = solver;
    c->y = y;
    c->yp = y + road->size;
    c->q = c->yp + road->size;
    c->qd = c->q + n;
    c->qdd = c->qd + n;
    c->lambda = c->qdd + n;
    return true;
}

kmp_crossing *kmp_crossing_new(const kempe_system *system, kmp_plant *plant, kmp_road *road,
                               const kmp_solver_kind *kind, void *solver, double span, kmp_journal *journal)
{
    kmp_crossing *c = KMP_NEW(kmp_crossing, 1);
    if (!c)
        return NULL;
    *c = (kmp_crossing){.s = system, .plant = plant, .journal = journal, .instant = INSTANT * span, .end = -1};
    bool ok = kmp_crossing_move(c, road, kind, solver);
    c->change = KMP_NEW(double, 3 * system->events.count);
    c->repeats = KMP_NEW(int, system->events.count);
    c->stays = KMP_NEW(bool, system->events.count);
    if (!ok || !c->change || !c->repeats || !c->stays) {
        kmp_crossing_free(c);
        return NULL;
    }
    c->last = c->change + system->events.count;
    c->most = c->last + system->events.count;
    for (int k = 0; k < system->events.count; k++)
        c->last[k] = -INFINITY;
    return c;
}

void kmp_crossing_free(kmp_crossing *c)
{
    if (!c)
        return;
    kmp_free(c->y);
    kmp_free(c->change);
    kmp_free(c->repeats);
    kmp_free(c->stays);
    kmp_free(c);
}

bool kmp_crossing_is_stuck(const kmp_crossing *c)
{
    return c->stuck;
}

long kmp_crossing_count(const kmp_crossing *c)
{
    return c->count;
}

/* -- looking ----------------------------------------------------------------------------------------- */

/* Whether condition k is no longer what is held. */
static bool has_changed(const kmp_crossing *c, int k)
{
    return (c->change[k] < 0) != (c->plant->mode[k] > 0);
}

/* First condition that has changed, -1 for none. */
static int first_changed(const kmp_crossing *c)
{
    for (int k = 0; k < c->s->events.count; k++)
        if (has_changed(c, k))
            return k;
    return -1;
}

/* First one that others do not follow but that ends the run, -1 for none. */
static int first_end(const kmp_crossing *c)
{
    for (int k = 0; k < c->s->events.count; k++)
        if (c->s->events.condition[k].ends && has_changed(c, k))
            return k;
    return -1;
}

/* Whether one has changed that changes what the equations are. */
static bool has_switched(const kmp_crossing *c, int k)
{
    return !c->s->events.condition[k].ends && !c->stays[k] && has_changed(c, k);
}

static int first_switched(const kmp_crossing *c)
{
    for (int k = 0; k < c->s->events.count; k++)
        if (has_switched(c, k))
            return k;
    return -1;
}

/* Condition k has not changed there. */
static void note_size(kmp_crossing *c, int k)
{
    c->most[k] = fmax(c->most[k], fabs(c->change[k]));
}

/* The state in c->y completed, or as much of it as conditions depend on, and the conditions there. */
static kempe_status complete(kmp_crossing *c, double t, bool whole)
{
    double *qd = whole || c->s->changes_by_rates ? c->qd : NULL, *qdd = whole || c->s->changes_late ? c->qdd : NULL;
    if (c->road->row(c->road, t, c->y, c->yp, c->q, qd, qdd, c->lambda, &c->work) != KMP_GO)
        return KEMPE_E_FAILED;
    kmp_plant_all_changes(c->plant, t, c->q, c->qd, c->qdd, c->lambda, c->change);
    return KEMPE_OK;
}

static kempe_status look(kmp_crossing *c, double t)
{
    kempe_status status = c->kind->dense(c->solver, t, c->y, c->kind->dae ? c->yp : NULL);
    return status == KEMPE_OK ? complete(c, t, false) : status;
}

/* A point from `low` on where condition k is as held: beyond a start just after an event, where rounding decides. Not
 * found: it changes at once. */
static kempe_status find_side(kmp_crossing *c, int k, double *low, double high, bool *found)
{
    double from = *low, width = high - from, least = 4 * DBL_EPSILON * fmax(fabs(from), width);
    kempe_status status = look(c, *low);
    while (status == KEMPE_OK && has_changed(c, k) && width > least) {
        width /= 2;
        *low = from + width;
        status = look(c, *low);
    }
    *found = status == KEMPE_OK && !has_changed(c, k);
    if (*found)
        note_size(c, k);
    *low = *found ? *low : from;
    return status;
}

/* One point between a, where condition k is as held, and b, where it has changed. */
static double next_point(double a, double fa, double b, double fb, double tolerance, bool bisect)
{
    double x = bisect ? a + 0.5 * (b - a) : a + (b - a) * (fa / (fa - fb));
    return fmin(fmax(x, a + 0.5 * tolerance), b - 0.5 * tolerance);
}

/* Narrows (low, *high], at whose end condition k has changed, to rounding. Leaves c at *high. */
static kempe_status narrow(kmp_crossing *c, int k, double low, double *high)
{
    double a = low, b = *high, fb = c->change[k], width = 2 * (b - a);
    bool found;
    kempe_status status = find_side(c, k, &a, b, &found);
    double fa = c->change[k], tolerance = 4 * DBL_EPSILON * fmax(fabs(a), fabs(b));
    if (!found)
        b = low;
    for (int i = 0, side = 0; status == KEMPE_OK && b - a > tolerance && i < MOST_ITERATIONS; i++) {
        bool bisect = i % 3 == 2 && b - a > width / 4;
        width = i % 3 == 2 ? b - a : width;
        double x = next_point(a, fa, b, fb, tolerance, bisect);
        status = look(c, x);
        if (has_changed(c, k)) {
            b = x;
            fb = c->change[k];
            fa = side < 0 ? 0.5 * fa : fa;
            side = -1;
        } else {
            a = x;
            fa = c->change[k];
            note_size(c, k);
            fb = side > 0 ? 0.5 * fb : fb;
            side = 1;
        }
    }
    *high = b;
    return status == KEMPE_OK ? look(c, b) : status;
}

/* The earliest change in (low, *high], at whose end c is and something has changed. */
static kempe_status find_earliest(kmp_crossing *c, double low, double *high)
{
    kempe_status status = KEMPE_OK;
    for (int k = 0; status == KEMPE_OK && *high > low && k < c->s->events.count; k++)
        if (has_changed(c, k))
            status = narrow(c, k, low, high);
    return status;
}

kempe_status kmp_crossing_find(kmp_crossing *c, double *t, bool *found)
{
    double from = c->kind->t_old(c->solver), end = c->kind->t(c->solver), low = from;
    *found = false;
    c->end = -1;
    for (int i = 1; i <= POINTS && end > from; i++) {
        double high = i == POINTS ? end : from + (end - from) * i / POINTS;
        kempe_status status = look(c, high);
        if (status != KEMPE_OK)
            return status;
        if (first_changed(c) >= 0) {
            *found = true;
            status = find_earliest(c, low, &high);
            c->end = status == KEMPE_OK ? first_end(c) : -1;
            *t = high;
            return status;
        }
        for (int k = 0; k < c->s->events.count; k++)
            note_size(c, k);
        low = high;
    }
    return KEMPE_OK;
}

int kmp_crossing_end(const kmp_crossing *c)
{
    return c->end;
}

kempe_status kmp_crossing_begin(kmp_crossing *c, double t, bool *ends)
{
    bool any = false;
    for (int k = 0; k < c->s->events.count; k++)
        any = any || c->s->events.condition[k].ends;
    *ends = false;
    if (!any)
        return KEMPE_OK;
    kempe_status status = look(c, t);
    c->end = status == KEMPE_OK ? first_end(c) : -1;
    *ends = c->end >= 0;
    return status;
}

/* -- passing ----------------------------------------------------------------------------------------- */

/* Whether condition k, which changes at t, has done so a moment ago. */
static bool just_changed(const kmp_crossing *c, int k, double t)
{
    double lag = c->s->events.condition[k].lag;
    bool near = lag > 0 && c->most[k] <= LAGS * lag;
    return near || t - c->last[k] <= fmax(64 * DBL_EPSILON * fabs(t), c->instant);
}

static kempe_status change_condition(kmp_crossing *c, int k, double t)
{
    const char *advice = c->s->events.condition[k].advice;
    bool holds = !(c->plant->mode[k] > 0);
    const kmp_expr *e = c->s->events.condition[k].expr;
    bool stated = !e || (e->kind != KMP_EXPR_AT_MOST && e->kind != KMP_EXPR_AT_LEAST);
    kmp_plant_set_mode(c->plant, k, holds);
    kmp_journal_note(c->journal, "event", t, NAN, NAN, "%s became %s", c->s->event_text[k],
                     holds == stated ? "true" : "false");
    c->count++;
    c->repeats[k] = just_changed(c, k, t) ? c->repeats[k] + 1 : 0;
    c->last[k] = t;
    c->most[k] = 0;
    if (c->repeats[k] < MOST_REPEATS)
        return KEMPE_OK;
    c->stuck = true;
    return kmp_fail(c->s->context, KEMPE_E_FAILED, "%s changes back and forth at t = %.9g: %s", c->s->event_text[k], t,
                    advice ? advice
                           : "the motion slides along it; make the law continuous there, for instance with tanh");
}

/* Conditions may depend on others, so that one change brings the next. */
static kempe_status change_conditions(kmp_crossing *c, double t)
{
    kempe_status status = KEMPE_OK;
    for (int pass = 0; pass < MOST_REPEATS && first_switched(c) >= 0; pass++) {
        for (int k = 0; status == KEMPE_OK && k < c->s->events.count; k++)
            if (has_switched(c, k))
                status = change_condition(c, k, t);
        if (status != KEMPE_OK)
            return status;
        memcpy(c->change, kmp_plant_changes(c->plant, t, c->q, c->qd), (size_t)c->s->events.count * sizeof(double));
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
    memcpy(c->q, q, (size_t)c->s->n * sizeof *q);
    memcpy(c->qd, qd, (size_t)c->s->n * sizeof *qd);
    memcpy(c->change, kmp_plant_changes(c->plant, t, q, qd), (size_t)count * sizeof(double));
    for (int k = 0; k < count; k++)
        c->stays[k] = again && (c->stays[k] || c->last[k] == t);
    *changed = first_switched(c) >= 0;
    kempe_status status = change_conditions(c, t);
    memset(c->stays, 0, again && !*changed ? (size_t)count * sizeof *c->stays : 0);
    return status;
}

kempe_status kmp_crossing_pass(kmp_crossing *c, double t, double *y, double *yp)
{
    kempe_status status = look(c, t);
    if (status == KEMPE_OK)
        status = change_conditions(c, t);
    if (status == KEMPE_OK)
        status = complete(c, t, true); /* accelerations and multipliers beyond */
    if (status != KEMPE_OK)
        return status;
    memcpy(y, c->y, (size_t)c->road->size * sizeof *y);
    if (yp)
        memcpy(yp, c->yp, (size_t)c->road->size * sizeof *yp);
    return c->road->resume(c->road, t, c->q, c->qd, c->qdd, c->lambda, y, yp) == KMP_GO ? KEMPE_OK : KEMPE_E_FAILED;
}
