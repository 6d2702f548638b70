/* SPDX-License-Identifier: BSD-3-Clause */
/* Unknowns: u and its sensitivities, p each, then ud and its, then the integral and its. */
#include "analysis/forward.h"
#include "base/memory.h"
#include "constraints/tolerances.h"
#include <float.h>
#include <math.h>
#include <string.h>

enum { MOST_HALVINGS = 200, MOST_AT_ONCE = 1000 };

/* An event whose condition changes no faster than this part of its usual rate is touched, not passed. */
#define GRAZING 1e-9

typedef struct forward {
    kmp_varied *v;
    const kmp_forward *ask;
    kmp_forward_report *report;
    const kmp_solver_kind *kind;
    void *solver;
    kmp_ode ode;
    const double *sizes;
    int n, m, p, count, size, integrals; /* the last of the unknowns */
    double *y, *atol;
    double *q, *qd, *dq, *dqd, *dqdd, *dlambda, *dshown; /* a row; count times for the slopes */
    double *matrix;                                      /* 2 p x 2 p */
    int *signs, *signs_now, *old_u;
    double *old_y, *old_mode, *before; /* 2 p; conditions; p */
    double *swing, *unit;              /* count: dt_e/dp; zeros */
    double *changes, *changes_along;   /* conditions */
    int next_row, at_once;
    double event_t;
    kmp_text reason;
} forward;

static int blocks(const forward *f)
{
    return f->p * (1 + f->count);
}

static const double *position_of(const forward *f, const double *y, int k)
{
    return y + (k + 1) * f->p;
}

static const double *rate_of(const forward *f, const double *y, int k)
{
    return y + blocks(f) + (k + 1) * f->p;
}

static double weighted(int count, const double *w, const double *x)
{
    double sum = 0;
    for (int i = 0; w && i < count; i++)
        sum += w[i] != 0 ? w[i] * x[i] : 0; /* what is not asked for may be no number */
    return sum;
}

static double target_of(const kmp_target *w, const kmp_varied *v, const double *q, const double *qd, const double *qdd,
                        const double *lambda, const double *shown)
{
    return weighted(v->n, w->q, q) + weighted(v->n, w->qd, qd) + weighted(v->n, w->qdd, qdd) +
           weighted(v->m, w->lambda, lambda) + weighted(v->slopes->shown, w->shown, shown);
}

double kmp_target_value(const kmp_target *target, kmp_varied *varied)
{
    const kmp_linear *l = &varied->linear;
    kmp_instant at = kmp_varied_instant(varied);
    const double *shown = target->shown ? kmp_slopes_outputs(varied->slopes, &at) : NULL;
    return target_of(target, varied, l->q, l->qd, l->qdd, l->lambda, shown);
}

/* -- the ODE ----------------------------------------------------------------------------------------- */

/* The outputs' change along that of parameter k, into `out`. */
static void outputs_along(forward *f, int k, double *q, double *qd, double *qdd, double *lambda, double *out)
{
    f->unit[k] = 1;
    kmp_slopes_outputs_along(f->v->slopes, &(kmp_direction){NULL, q, qd, qdd, lambda, f->unit}, out);
    f->unit[k] = 0;
}

static void integrate_outputs(forward *f, const double *y, double *dy)
{
    kmp_varied *v = f->v;
    const kmp_target *target = f->ask->integrand;
    dy[0] = kmp_target_value(target, v);
    for (int k = 0; k < f->count; k++) {
        kmp_varied_follow(v, k, position_of(f, y, k), rate_of(f, y, k), f->dq, f->dqd, f->dqdd, f->dlambda);
        if (target->shown)
            outputs_along(f, k, f->dq, f->dqd, f->dqdd, f->dlambda, v->shown);
        dy[1 + k] = target_of(target, v, f->dq, f->dqd, f->dqdd, f->dlambda, v->shown);
    }
}

static int rhs(void *self, double t, const double *y, double *dy)
{
    forward *f = self;
    kmp_varied *v = f->v;
    int p = f->p, half = blocks(f);
    if (kmp_varied_at(v, t, y, y + half) != KMP_GO)
        return KMP_RETRY;
    memcpy(dy, y + half, (size_t)half * sizeof *dy);
    for (int i = 0; i < p; i++)
        dy[half + i] = v->linear.qdd[v->linear.part.u[i]];
    if (f->count > 0)
        kmp_varied_parts(v);
    for (int k = 0; k < f->count; k++)
        kmp_varied_accelerate(v, k, position_of(f, y, k), rate_of(f, y, k), dy + half + (k + 1) * p);
    if (f->integrals)
        integrate_outputs(f, y, dy + 2 * half);
    return KMP_GO;
}

/* df/dy of (u, ud): what the sensitivities have for theirs as well. How that changes with u, which Newton does not
 * need, is left out. */
static int state_jacobian(forward *f, double t, const double *y)
{
    kmp_linear *l = &f->v->linear;
    bool plain = l->plain;
    int p = f->p;
    l->plain = false;
    int said = kmp_varied_at(f->v, t, y, y + blocks(f));
    l->plain = plain;
    if (said != KMP_GO)
        return said;
    kmp_linear_matrices(l);
    for (int k = 0; k < p; k++) {
        kmp_linear_accelerate(l, l->stiffness + k * p, f->matrix + k * p);
        kmp_linear_accelerate(l, l->damping + k * p, f->matrix + (p + k) * p);
    }
    return KMP_GO;
}

static int jacobian(void *self, double t, const double *y, double *j)
{
    forward *f = self;
    int p = f->p, half = blocks(f);
    if (state_jacobian(f, t, y) != KMP_GO)
        return KMP_RETRY;
    for (int i = 0; i < half; i++)
        j[i + (half + i) * f->size] = 1;
    for (int b = 0; b <= f->count; b++)
        for (int k = 0; k < p; k++)
            for (int i = 0; i < p; i++) {
                j[half + b * p + i + (b * p + k) * f->size] = f->matrix[i + k * p];
                j[half + b * p + i + (half + b * p + k) * f->size] = f->matrix[i + (p + k) * p];
            }
    return KMP_GO;
}

/* At the end of a step that passed the error test, evaluated last: it must not have jumped a dead centre of u. */
static int accept(void *self, double t, double *y, const double *dy, const double *w)
{
    forward *f = self;
    const kmp_reduction *red = &f->v->linear.red;
    (void)t, (void)y, (void)dy, (void)w;
    if (red->r == 0)
        return KMP_GO;
    kmp_block_take_signs(red->block, f->signs_now);
    size_t count = (size_t)kmp_block_count(red->block);
    if (memcmp(f->signs, f->signs_now, count * sizeof *f->signs) != 0)
        return KMP_RETRY;
    return KMP_GO;
}

/* -- weights ----------------------------------------------------------------------------------------- */

double kmp_varied_rate_scale(const kmp_varied *varied, double t_end)
{
    double scale = 1 / t_end;
    for (int i = 0; i < varied->n; i++) {
        scale = fmax(scale, fabs(varied->linear.qd[i]) / varied->system->scale[i]);
        scale = fmax(scale, sqrt(fabs(varied->linear.qdd[i]) / varied->system->scale[i]));
    }
    return scale;
}

static void set_weights(forward *f)
{
    const kmp_varied *v = f->v;
    int half = blocks(f);
    for (int b = 0; b <= f->count; b++)
        for (int i = 0; i < f->p; i++) {
            double of = f->ask->atol * v->system->scale[v->linear.part.u[i]] / (b ? f->sizes[b - 1] : 1);
            f->atol[b * f->p + i] = of;
            f->atol[half + b * f->p + i] = of * f->report->rate_scale;
        }
    for (int b = 0; b < f->integrals; b++)
        f->atol[2 * half + b] = f->ask->atol * f->ask->t_end / (b ? f->sizes[b - 1] : 1);
}

/* -- the start --------------------------------------------------------------------------------------- */

/* y from a state whose coordinates and their slopes are in q, qd, dq, dqd. */
static void pack(forward *f)
{
    const int *u = f->v->linear.part.u;
    int half = blocks(f);
    for (int i = 0; i < f->p; i++) {
        f->y[i] = f->q[u[i]];
        f->y[half + i] = f->qd[u[i]];
        for (int k = 0; k < f->count; k++) {
            f->y[(k + 1) * f->p + i] = f->dq[k * f->n + u[i]];
            f->y[half + (k + 1) * f->p + i] = f->dqd[k * f->n + u[i]];
        }
    }
}

static bool make_rows(forward *f)
{
    size_t n = (size_t)f->n, m = (size_t)f->m, count = (size_t)f->v->count, many = count ? count : 1;
    size_t conditions = (size_t)f->v->system->events.count, shown = (size_t)f->v->slopes->shown;
    f->q = KMP_NEW(double, n);
    f->qd = KMP_NEW(double, n);
    f->dq = KMP_NEW(double, n *many);
    f->dqd = KMP_NEW(double, n *many);
    f->dqdd = KMP_NEW(double, n *many);
    f->dlambda = KMP_NEW(double, m *many);
    f->dshown = KMP_NEW(double, shown *many);
    f->swing = KMP_NEW(double, count);
    f->unit = KMP_NEW(double, count);
    f->old_mode = KMP_NEW(double, conditions);
    f->changes = KMP_NEW(double, conditions);
    f->changes_along = KMP_NEW(double, conditions);
    f->signs = KMP_NEW(int, n);
    f->signs_now = KMP_NEW(int, n);
    f->old_u = KMP_NEW(int, n);
    return f->q && f->qd && f->dq && f->dqd && f->dqdd && f->dlambda && f->dshown && f->swing && f->unit &&
           f->old_mode && f->changes && f->changes_along && f->signs && f->signs_now && f->old_u;
}

static bool make_unknowns(forward *f)
{
    f->p = f->v->linear.p;
    f->integrals = f->ask->integrand ? 1 + f->count : 0;
    f->size = 2 * blocks(f) + f->integrals;
    f->y = KMP_NEW(double, f->size);
    f->atol = KMP_NEW(double, f->size);
    f->matrix = KMP_NEW(double, 2 * f->p * f->p);
    f->old_y = KMP_NEW(double, 2 * f->p);
    f->before = KMP_NEW(double, f->p);
    f->ode = (kmp_ode){.n = f->size,
                       .self = f,
                       .rhs = rhs,
                       .accept = accept,
                       .jacobian = jacobian,
                       .positions = blocks(f),
                       .quadratures = f->integrals};
    return f->y && f->atol && f->matrix && f->old_y && f->before;
}

static void free_all(forward *f)
{
    void *rooms[] = {f->q,       f->qd,        f->dq,       f->dqd,     f->dqdd,
                     f->dlambda, f->dshown,    f->swing,    f->changes, f->changes_along,
                     f->signs,   f->signs_now, f->old_u,    f->y,       f->atol,
                     f->matrix,  f->old_y,     f->old_mode, f->before,  f->unit};
    for (size_t k = 0; k < sizeof rooms / sizeof *rooms; k++)
        kmp_free(rooms[k]);
    if (f->solver)
        f->kind->release(f->solver);
    kmp_text_free(&f->reason);
}

/* The signs of Jv's blocks, and predictions, from the last state on. */
static void settle(forward *f)
{
    if (f->v->linear.red.r > 0)
        kmp_block_take_signs(f->v->linear.red.block, f->signs);
    kmp_varied_anchor(f->v);
}

static kempe_status prepare(forward *f)
{
    kmp_varied *v = f->v;
    kempe_context *context = v->system->context;
    if (!make_rows(f))
        return kmp_fail_memory(context);
    v->linear.plain = false;
    kempe_status status = kmp_varied_start(v, f->q, f->qd, f->dq, f->dqd);
    v->linear.plain = f->ask->alone;
    if (status == KEMPE_OK)
        status = kmp_varied_choose(v, 0, f->q, f->qd, f->ask->u, f->ask->u_count);
    if (status == KEMPE_OK && !make_unknowns(f))
        status = kmp_fail_memory(context);
    if (status != KEMPE_OK)
        return status;
    pack(f);
    size_t slopes = (size_t)(f->n * v->count) * sizeof(double);
    if (f->ask->start_q)
        memcpy(f->ask->start_q, f->dq, slopes);
    if (f->ask->start_qd)
        memcpy(f->ask->start_qd, f->dqd, slopes);
    if (kmp_varied_at(v, 0, f->y, f->y + blocks(f)) != KMP_GO)
        return kmp_fail(context, KEMPE_E_FAILED,
                        "the start cannot be evaluated: its closures are singular, or a coordinate moves no mass");
    f->report->rate_scale = kmp_varied_rate_scale(v, f->ask->t_end);
    set_weights(f);
    settle(f);
    f->solver = f->kind->create(&(kmp_solver_setup){
        .context = context, .ode = &f->ode, .tolerance = {f->ask->rtol, f->atol}, .linear = "auto"});
    if (!f->solver)
        return KEMPE_E_MEMORY;
    double h = f->kind->implicit ? fmin(1e-3 / f->report->rate_scale, f->ask->t_end) : 0;
    return f->kind->start(f->solver, 0, f->y, NULL, f->ask->t_end, h);
}

/* -- between steps ----------------------------------------------------------------------------------- */

static int unknowns_at(void *motion, double t, double *y)
{
    forward *f = motion;
    if (f->kind->dense(f->solver, t, f->y, NULL) != KEMPE_OK)
        return KMP_HALT;
    memcpy(y, f->y, (size_t)f->p * sizeof *y);
    memcpy(y + f->p, f->y + blocks(f), (size_t)f->p * sizeof *y);
    return KMP_GO;
}

static int state_at(forward *f, double t, double *q, double *qd)
{
    const kmp_linear *l = &f->v->linear;
    if (f->kind->dense(f->solver, t, f->y, NULL) != KEMPE_OK ||
        kmp_varied_at(f->v, t, f->y, f->y + blocks(f)) != KMP_GO)
        return KMP_RETRY;
    memcpy(q, l->q, (size_t)f->n * sizeof *q);
    memcpy(qd, l->qd, (size_t)f->n * sizeof *qd);
    return KMP_GO;
}

/* dq and dqd of all parameters at the last state, which is that of y. */
static void spread(forward *f)
{
    kmp_varied *v = f->v;
    if (f->count > 0)
        kmp_varied_parts(v);
    for (int k = 0; k < f->count; k++) {
        kmp_change change = kmp_varied_change(v, k, position_of(f, f->y, k), rate_of(f, f->y, k), NULL);
        kmp_linear_follow(&v->linear, &change, &(kmp_response){f->dq + k * f->n, f->dqd + k * f->n, NULL, NULL, NULL});
    }
}

static void keep_old(forward *f)
{
    const kmp_plant *plant = f->v->linear.plant;
    memcpy(f->old_u, f->v->linear.part.u, (size_t)f->p * sizeof *f->old_u);
    memcpy(f->old_y, f->y, (size_t)f->p * sizeof *f->y);
    memcpy(f->old_y + f->p, f->y + blocks(f), (size_t)f->p * sizeof *f->y);
    if (f->v->system->events.count > 0)
        memcpy(f->old_mode, plant->mode, (size_t)f->v->system->events.count * sizeof *f->old_mode);
}

static kempe_status tell_mark(forward *f, double t, int condition)
{
    const kmp_linear *l = &f->v->linear;
    const kmp_varied_mark mark = {t, condition, f->p, f->old_u, l->part.u, l->q, f->old_y, f->old_mode, l->plant->mode};
    int said = f->ask->watch.mark ? f->ask->watch.mark(f->ask->watch.user, &mark) : 0;
    return said ? kmp_fail_memory(f->v->system->context) : KEMPE_OK;
}

static kempe_status restart(forward *f, double t)
{
    double h = f->kind->next ? f->kind->next(f->solver) : f->kind->t(f->solver) - f->kind->t_old(f->solver);
    return f->kind->start(f->solver, t, f->y, NULL, f->ask->t_end, fmin(h, f->ask->t_end - t));
}

/* The state at the end of the last step, in y and as the last one evaluated. */
static kempe_status stand_at(forward *f, double t)
{
    if (state_at(f, t, f->q, f->qd) == KMP_GO)
        return KEMPE_OK;
    kmp_text_printf(&f->reason, "the loops do not close at t = %.9g", t);
    return KEMPE_E_FAILED;
}

/* Other coordinates become independent where dependent ones grow too fast with these. */
static kempe_status exchange(forward *f, double t)
{
    kmp_varied *v = f->v;
    int row, column;
    kempe_status status = stand_at(f, t);
    if (status != KEMPE_OK || v->linear.red.r == 0)
        return status;
    settle(f);
    if (kmp_reduction_growth(&v->linear.red, &row, &column) <= KMP_EXCHANGE_CLOSED)
        return KEMPE_OK;
    keep_old(f);
    spread(f);
    status = kmp_varied_choose(v, t, f->q, f->qd, NULL, 0);
    if (status == KEMPE_OK && v->linear.p != f->p)
        status = kmp_fail(v->system->context, KEMPE_E_FAILED,
                          "the mechanism comes to a change point at t = %.9g, where its freedoms are %d, not %d", t,
                          v->linear.p, f->p);
    if (status != KEMPE_OK)
        return status;
    pack(f);
    set_weights(f);
    if (kmp_varied_at(v, t, f->y, f->y + blocks(f)) != KMP_GO)
        return kmp_fail(v->system->context, KEMPE_E_FAILED, "the closures are singular at t = %.9g", t);
    settle(f);
    f->report->exchanges += memcmp(f->old_u, v->linear.part.u, (size_t)f->p * sizeof *f->old_u) != 0;
    status = tell_mark(f, t, -1);
    return status == KEMPE_OK ? restart(f, t) : status;
}

/* -- conditions -------------------------------------------------------------------------------------- */

/* Whether condition k, as it is held, is otherwise at t; its value there. */
static bool differs(forward *f, int k, const double *changes)
{
    return (changes[k] < 0) != (f->v->linear.plant->mode[k] != 0);
}

static const double *changes_at(forward *f, double t)
{
    if (state_at(f, t, f->q, f->qd) != KMP_GO)
        return NULL;
    return kmp_plant_changes(f->v->linear.plant, t, f->q, f->qd);
}

/* Where condition k changes within (from, to], just beyond it: bisection and the Illinois rule in turn. */
static double find_change(forward *f, int k, double from, double to)
{
    const double *c = changes_at(f, from);
    double a = c ? c[k] : 0;
    c = changes_at(f, to);
    double b = c ? c[k] : 0;
    for (int i = 0; i < MOST_HALVINGS && to - from > 4 * DBL_EPSILON * fabs(to); i++) {
        double middle = from + (to - from) / 2;
        if (i % 3 != 2 && a * b < 0)
            middle = fmin(fmax(to - b * (to - from) / (b - a), from), to);
        if (!(middle > from && middle < to))
            middle = from + (to - from) / 2;
        if (!(middle > from && middle < to))
            break;
        c = changes_at(f, middle);
        if (!c)
            break;
        if (differs(f, k, c)) {
            to = middle;
            b = c[k];
            a /= 2;
        } else {
            from = middle;
            a = c[k];
            b /= 2;
        }
    }
    return to;
}

/* The first condition to change in the last step; -1: none. */
static int first_change(forward *f, double *t)
{
    int count = f->v->system->events.count, first = -1;
    double from = f->kind->t_old(f->solver), to = f->kind->t(f->solver);
    *t = to;
    const double *c = count > 0 && to > from ? changes_at(f, to) : NULL;
    for (int k = 0; c && k < count; k++)
        f->changes_along[k] = differs(f, k, c) ? 1 : 0;
    for (int k = 0; c && k < count; k++) {
        if (f->changes_along[k] == 0)
            continue;
        double at = find_change(f, k, from, to);
        if (first < 0 || at < *t) {
            first = k;
            *t = at;
        }
    }
    return first;
}

/* dt_e/dp of condition k at the last state, whose dq and dqd are there. false: it is not passed but touched. */
static bool find_swing(forward *f, int k)
{
    kmp_varied *v = f->v;
    kmp_linear *l = &v->linear;
    double one = 1, *along = f->changes_along, rate, faster;
    kmp_instant at = kmp_varied_instant(v);
    (void)kmp_slopes_events(v->slopes, &at);
    kmp_slopes_events_along(v->slopes, &(kmp_direction){&one, l->qd, l->qdd, NULL, NULL, NULL}, along);
    rate = along[k];
    kmp_slopes_events_along(v->slopes, &(kmp_direction){NULL, NULL, l->qdd, NULL, NULL, NULL}, along);
    faster = fabs(along[k]) + fabs(rate - along[k]);
    for (int i = 0; i < f->count; i++) {
        f->unit[i] = 1;
        kmp_slopes_events_along(
            v->slopes, &(kmp_direction){NULL, f->dq + i * f->n, f->dqd + i * f->n, NULL, NULL, f->unit}, along);
        f->unit[i] = 0;
        f->swing[i] = -along[k] / rate;
    }
    return fabs(rate) > GRAZING * faster;
}

static kempe_status too_many(forward *f, int k, double t)
{
    kmp_text_printf(&f->reason, "the condition %s changes back and forth at t = %.9g", f->v->system->event_text[k], t);
    return KEMPE_E_FAILED;
}

static double integrand_here(forward *f)
{
    return f->integrals ? kmp_target_value(f->ask->integrand, f->v) : 0;
}

static void take_accelerations(const forward *f, double *udd)
{
    const kmp_linear *l = &f->v->linear;
    for (int i = 0; i < f->p; i++)
        udd[i] = l->qdd[l->part.u[i]];
}

/* What is before less what is behind, times dt_e/dp. */
static void jump(forward *f, double integrand_before)
{
    int half = blocks(f);
    double integrand = integrand_before - integrand_here(f);
    for (int i = 0; i < f->p; i++)
        f->before[i] -= f->v->linear.qdd[f->v->linear.part.u[i]];
    for (int k = 0; k < f->count; k++) {
        for (int i = 0; i < f->p; i++)
            f->y[half + (k + 1) * f->p + i] += f->before[i] * f->swing[k];
        if (f->integrals)
            f->y[2 * half + 1 + k] += integrand * f->swing[k];
    }
}

static kempe_status end_at(forward *f, int condition, double t)
{
    kmp_text_printf(&f->reason, "%s at t = %.9g s", f->v->system->event_text[condition], t);
    return KEMPE_STOPPED;
}

/* Conditions on multipliers and accelerations end it at the end of a step. */
static kempe_status look_late(forward *f, double t)
{
    const kempe_system *s = f->v->system;
    const kmp_linear *l = &f->v->linear;
    bool any = false;
    for (int k = 0; k < s->events.count; k++)
        any = any || s->events.condition[k].late;
    kempe_status status = any ? stand_at(f, t) : KEMPE_OK;
    if (!any || status != KEMPE_OK)
        return status;
    kmp_plant_all_changes(l->plant, t, l->q, l->qd, l->qdd, l->lambda, f->changes);
    for (int k = 0; k < s->events.count; k++)
        if (s->events.condition[k].late && f->changes[k] < 0)
            return end_at(f, k, t);
    return KEMPE_OK;
}

/* Condition k changes at t, just beyond its change. */
static kempe_status pass(forward *f, int k, double t)
{
    kmp_varied *v = f->v;
    f->at_once = t > f->event_t ? 0 : f->at_once + 1;
    f->event_t = t;
    if (v->system->events.condition[k].ends)
        return end_at(f, k, t);
    if (f->at_once > MOST_AT_ONCE)
        return too_many(f, k, t);
    if (v->system->switches) {
        kmp_text_printf(&f->reason,
                        "closures switch where %s changes at t = %.9g: derivatives of rates that jump are not known",
                        v->system->event_text[k], t);
        return KEMPE_E_FAILED;
    }
    kempe_status status = stand_at(f, t);
    if (status != KEMPE_OK)
        return status;
    keep_old(f);
    spread(f);
    if (f->count > 0 && !find_swing(f, k)) {
        kmp_text_printf(&f->reason,
                        "the condition %s is touched at t = %.9g, not passed: the motion has no derivative by "
                        "parameters there",
                        v->system->event_text[k], t);
        return KEMPE_E_FAILED;
    }
    double integrand = integrand_here(f);
    take_accelerations(f, f->before);
    kmp_plant_set_mode(v->linear.plant, k, v->linear.plant->mode[k] == 0);
    if (kmp_varied_at(v, t, f->y, f->y + blocks(f)) != KMP_GO) {
        kmp_text_printf(&f->reason, "the motion cannot go on behind the condition %s at t = %.9g",
                        v->system->event_text[k], t);
        return KEMPE_E_FAILED;
    }
    jump(f, integrand);
    settle(f);
    f->report->events++;
    status = tell_mark(f, t, k);
    return status == KEMPE_OK ? restart(f, t) : status;
}

/* -- rows -------------------------------------------------------------------------------------------- */

static void follow_all(forward *f)
{
    kmp_varied *v = f->v;
    if (f->count > 0)
        kmp_varied_parts(v);
    for (int k = 0; k < f->count; k++) {
        double *dq = f->dq + k * f->n, *dqd = f->dqd + k * f->n, *dqdd = f->dqdd + k * f->n;
        double *dlambda = f->dlambda + k * f->m;
        kmp_varied_follow(v, k, position_of(f, f->y, k), rate_of(f, f->y, k), dq, dqd, dqdd, dlambda);
        if (v->slopes->shown > 0)
            outputs_along(f, k, dq, dqd, dqdd, dlambda, f->dshown + k * v->slopes->shown);
    }
}

static kempe_status deliver(forward *f, double until)
{
    const kmp_forward *ask = f->ask;
    const kmp_linear *l = &f->v->linear;
    for (; f->next_row < ask->time_count && ask->times[f->next_row] <= until; f->next_row++) {
        kempe_status status = stand_at(f, ask->times[f->next_row]);
        if (status != KEMPE_OK)
            return status;
        kmp_instant at = kmp_varied_instant(f->v);
        const double *shown = kmp_slopes_outputs(f->v->slopes, &at);
        follow_all(f);
        const kmp_varied_row row = {l->t,  l->q,   l->qd,   l->qdd,     l->lambda, shown,
                                    f->dq, f->dqd, f->dqdd, f->dlambda, f->dshown};
        if (ask->watch.row && ask->watch.row(ask->watch.user, &row))
            return kmp_fail_memory(f->v->system->context);
    }
    return KEMPE_OK;
}

/* -- the run ----------------------------------------------------------------------------------------- */

static kempe_status step(forward *f)
{
    double from = f->kind->t(f->solver), t;
    kempe_status status = f->kind->step(f->solver);
    if (status == KEMPE_E_FAILED && kempe_context_message(f->v->system->context)[0] == '\0')
        kmp_text_printf(&f->reason,
                        "the step size became too small at t = %.9g: the motion is singular there, comes to a change "
                        "point, or is too fast for double precision",
                        from);
    if (status != KEMPE_OK)
        return status;
    int condition = first_change(f, &t);
    if (f->ask->watch.step && f->ask->watch.step(f->ask->watch.user, from, t, unknowns_at, f))
        return kmp_fail_memory(f->v->system->context);
    status = deliver(f, t);
    if (status == KEMPE_OK)
        status = look_late(f, t);
    const char *joint = status == KEMPE_OK ? kmp_varied_singular(f->v) : NULL;
    if (joint) {
        kmp_text_printf(&f->reason,
                        "the angles of spherical joint '%s' come near to their singular position at t = %.9g, beyond "
                        "which their derivatives do not go on; give it other axes",
                        joint, t);
        return KEMPE_E_FAILED;
    }
    if (status == KEMPE_OK && t < f->ask->t_end)
        status = condition >= 0 ? pass(f, condition, t) : exchange(f, t);
    f->report->t = t;
    return status;
}

static kempe_status advance(forward *f)
{
    kempe_status status = deliver(f, 0);
    while (status == KEMPE_OK && f->report->t < f->ask->t_end) {
        status = step(f);
        if (status == KEMPE_OK && kmp_interrupted(f->v->system->context)) {
            kmp_text_put(&f->reason, "interrupted");
            status = KEMPE_STOPPED;
        }
    }
    return status;
}

static void report_on(forward *f, double *integral)
{
    if (!f->solver)
        return;
    kmp_solver_work work = f->kind->work(f->solver);
    f->report->steps = work.steps;
    f->report->rejected = work.rejected;
    f->report->refused = work.refused;
    f->report->rhs = work.rhs;
    if (!f->integrals || f->kind->dense(f->solver, f->report->t, f->y, NULL) != KEMPE_OK)
        return;
    f->report->integral = f->y[2 * blocks(f)];
    for (int k = 0; integral && k < f->count; k++)
        integral[k] = f->y[2 * blocks(f) + 1 + k];
}

kempe_status kmp_forward_run(kmp_varied *varied, const kmp_forward *ask, const double *sizes, double *integral,
                             kmp_forward_report *report)
{
    forward f = {.v = varied,
                 .ask = ask,
                 .report = report,
                 .sizes = sizes,
                 .n = varied->n,
                 .m = varied->m,
                 .count = ask->alone ? 0 : varied->count};
    *report = (kmp_forward_report){0};
    f.event_t = -1;
    f.kind = kmp_solver_find(ask->integrator);
    if (!f.kind)
        return kmp_fail(varied->system->context, KEMPE_E_ARGUMENT, "there is no integrator '%s'", ask->integrator);
    kempe_status status = prepare(&f);
    if (status == KEMPE_OK)
        status = advance(&f);
    report_on(&f, integral);
    const char *message = kempe_context_message(varied->system->context);
    if (status == KEMPE_E_FAILED || status == KEMPE_STOPPED)
        report->reason = f.reason.length ? kmp_text_take(&f.reason) : kmp_strdup(message);
    if ((status == KEMPE_E_FAILED || status == KEMPE_STOPPED) && !report->reason)
        status = kmp_fail_memory(varied->system->context);
    free_all(&f);
    varied->linear.plain = false;
    return status;
}
