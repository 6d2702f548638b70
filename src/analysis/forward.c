/* SPDX-License-Identifier: BSD-3-Clause */
/* Unknowns: u and its sensitivities, p each, then ud and its, then the integral and its. The plant is the runner's: its
 * conditions and charts say at a new start what has changed since the last one.
 *
 * Where J comes near to losing a row the same goes on with all coordinates and their sensitivities in place of u, by
 * the integrator that leaps over such places (integrators/leap.h): u and what is smooth with it goes straight on. A
 * parameter that moves the closures there is no such thing; where it stands among the others nothing is leapt over. */
#include "analysis/forward.h"
#include "base/arena.h"
#include "base/memory.h"
#include "constraints/tolerances.h"
#include "integrators/redundant.h"
#include "integrators/road.h"
#include "model/change_points.h"
#include <math.h>
#include <string.h>

/* An event whose condition changes no faster than this part of its usual rate is touched, not passed. */
#define GRAZING 1e-9
/* |Bvu| from which on a step that could not be made is put down to a dead centre of u. */
#define FOLDED 20.0
/* Margin, of the usual one, below which it is put down to a change point. */
#define CHANGE_POINT 0.02
/* How far from its prediction (rad, characteristic lengths) a step may end: positions within it are found from there.
 */
#define FARTHEST 0.3
/* Margin at which a motion that is followed backwards later ends: only a change point has it. */
#define PASSING 1e-4
/* Nothing finer is to be had in a zone. */
#define ZONE_RTOL 1e-9

typedef struct forward {
    kmp_road road; /* first */
    kmp_arena arena;
    kmp_varied *v;
    kmp_plant *own; /* of v, while the runner's is lent */
    const kmp_forward *ask;
    const kempe_system *system;
    const double *sizes;
    kmp_margin *margin;
    int n, m, p, count, integrals; /* the last of the unknowns */
    int redundant;                 /* rows */
    int width, *every;             /* of the coordinates that are unknowns: p, in a zone n; 0 .. n - 1 */
    double rtol, atol, rate_scale, growth;
    bool begun, fixed, due, crossed, zone, own_angles;
    double t;                        /* of the place that is kept between two roads or charts: */
    double *chart, *q, *qd;          /* all charts; n */
    double *dq, *dqd;                /* count x n */
    double *tail;                    /* integrals */
    double *dqdd, *dlambda, *dshown; /* a row's, by all parameters */
    const double *row_y;             /* unknowns of the last whole row */
    double *matrix;                  /* 2 p x 2 p */
    int *signs, *signs_now, *old_u;
    double *old_q, *old_y, *old_chart; /* n; 2 p; charts: before a mark */
    double *mode, *new_mode;           /* conditions: as they were, and behind */
    double *next_mode;
    bool *cause;
    double *su, *sud, *ud;               /* p: rows of u of a zone's unknowns */
    double *before, *swing, *unit;       /* p; count: dt_e/dp; zeros */
    double *changes, *along, *new_chart; /* conditions; charts */
} forward;

static int blocks(const forward *f)
{
    return f->width * (1 + f->count);
}

/* The coordinates that are unknowns. */
static const int *unknowns_of(const forward *f)
{
    return f->zone ? f->every : f->v->linear.part.u;
}

/* The rows of u among the unknowns from `block` on; `room`: for p. */
static const double *rows_of(const forward *f, const double *block, double *room)
{
    if (!f->zone)
        return block;
    for (int i = 0; i < f->p; i++)
        room[i] = block[f->v->linear.part.u[i]];
    return room;
}

static const double *position_of(const forward *f, const double *y, int k)
{
    return rows_of(f, y + (k + 1) * f->width, f->su);
}

static const double *rate_of(const forward *f, const double *y, int k)
{
    return rows_of(f, y + blocks(f) + (k + 1) * f->width, f->sud);
}

/* The state at (t, y), with what small changes need unless linear.plain. */
static int come_to(forward *f, double t, const double *y)
{
    const double *ud = rows_of(f, y + blocks(f), f->ud);
    return f->zone ? kmp_varied_near(f->v, t, y, ud) : kmp_varied_at(f->v, t, y, ud);
}

static double weighted(int count, const double *w, const double *x)
{
    double sum = 0;
    for (int i = 0; w && i < count; i++)
        sum += w[i] != 0 ? w[i] * x[i] : 0; /* what is not asked for may be no number */
    return sum;
}

double kmp_target_of_row(const kmp_target *target, const kmp_varied *varied, const kmp_varied_row *row)
{
    const kmp_target *w = target;
    int n = varied->n;
    return weighted(n, w->q, row->q) + weighted(n, w->qd, row->qd) + weighted(n, w->qdd, row->qdd) +
           weighted(varied->m, w->lambda, row->lambda) + weighted(varied->slopes->shown, w->shown, row->shown);
}

double kmp_target_value(const kmp_target *target, kmp_varied *varied)
{
    const kmp_linear *l = &varied->linear;
    kmp_instant at = kmp_linear_instant(&varied->linear);
    const double *shown = target->shown ? kmp_slopes_values(&varied->slopes->outputs, &at) : NULL;
    const kmp_varied_row here = {.q = l->q, .qd = l->qd, .qdd = l->qdd, .lambda = l->lambda, .shown = shown};
    return kmp_target_of_row(target, varied, &here);
}

/* -- the ODE ----------------------------------------------------------------------------------------- */

/* The outputs' change along that of parameter k, into `out`. */
static void outputs_along(forward *f, int k, double *q, double *qd, double *qdd, double *lambda, double *out)
{
    f->unit[k] = 1;
    kmp_slopes_along(f->v->slopes, &f->v->slopes->outputs, &(kmp_direction){NULL, q, qd, qdd, lambda, f->unit}, out);
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
        const kmp_varied_row along = {
            .q = f->dq, .qd = f->dqd, .qdd = f->dqdd, .lambda = f->dlambda, .shown = v->shown};
        dy[1 + k] = kmp_target_of_row(target, v, &along);
    }
}

/* dy at the last state, which is that of y. */
static void give(forward *f, const double *y, double *dy)
{
    kmp_varied *v = f->v;
    int w = f->width, half = blocks(f);
    memcpy(dy, y + half, (size_t)half * sizeof *dy);
    for (int i = 0; i < w; i++)
        dy[half + i] = v->linear.qdd[unknowns_of(f)[i]];
    if (f->count > 0)
        kmp_varied_parts(v);
    for (int k = 0; k < f->count; k++) {
        const double *su = position_of(f, y, k), *sud = rate_of(f, y, k);
        if (f->zone)
            kmp_varied_follow(v, k, su, sud, f->dq, f->dqd, dy + half + (k + 1) * w, f->dlambda);
        else
            kmp_varied_accelerate(v, k, su, sud, dy + half + (k + 1) * w);
    }
    if (f->integrals)
        integrate_outputs(f, y, dy + 2 * half);
}

static int rhs(void *self, double t, const double *y, double *dy)
{
    forward *f = self;
    if (come_to(f, t, y) != KMP_GO)
        return KMP_RETRY;
    give(f, y, dy);
    return KMP_GO;
}

/* df/dy of (u, ud) is what the sensitivities have for theirs as well. How that changes with u, which Newton does not
 * need, is left out. */
static int jacobian(void *self, double t, const double *y, double *j)
{
    forward *f = self;
    kmp_linear *l = &f->v->linear;
    bool plain = l->plain;
    int p = f->p, half = blocks(f), size = f->road.size;
    l->plain = false;
    int said = come_to(f, t, y);
    l->plain = plain;
    if (said != KMP_GO)
        return KMP_RETRY;
    kmp_varied_matrix(f->v, f->matrix);
    for (int i = 0; i < half; i++)
        j[i + (half + i) * size] = 1;
    for (int b = 0; b < half; b += p)
        for (int k = 0; k < 2 * p; k++)
            memcpy(j + half + b + (b + k % p + (k < p ? 0 : half)) * size, f->matrix + k * p, (size_t)p * sizeof *j);
    return KMP_GO;
}

/* -- the place --------------------------------------------------------------------------------------- */

static kmp_plant *plant_of(const forward *f)
{
    return f->v->linear.plant;
}

static size_t chart_bytes(const forward *f)
{
    return (size_t)(KMP_CHART_SIZE * f->system->chart_count) * sizeof(double);
}

static size_t mode_bytes(const forward *f)
{
    return (size_t)f->system->events.count * sizeof(double);
}

/* The state at (t, y), with or without what its small changes need. */
static int stand_at(forward *f, double t, const double *y, bool whole)
{
    kmp_linear *l = &f->v->linear;
    l->plain = f->count == 0 || !whole;
    int said = come_to(f, t, y);
    l->plain = f->count == 0;
    if (said != KMP_GO && f->road.reason.length == 0)
        kmp_text_printf(&f->road.reason, "the loops do not close at t = %.9g", t);
    return said == KMP_GO ? KMP_GO : KMP_HALT;
}

/* The whole mechanism at (t, y) into the place. */
static int spread(forward *f, double t, const double *y)
{
    kmp_varied *v = f->v;
    if (stand_at(f, t, y, true) != KMP_GO)
        return KMP_HALT;
    f->t = t;
    memcpy(f->q, v->linear.q, (size_t)f->n * sizeof *f->q);
    memcpy(f->qd, v->linear.qd, (size_t)f->n * sizeof *f->qd);
    memcpy(f->chart, v->linear.plant->chart, chart_bytes(f));
    if (f->count > 0)
        kmp_varied_parts(v);
    for (int k = 0; k < f->count; k++) {
        kmp_change change = kmp_varied_change(v, k, position_of(f, y, k), rate_of(f, y, k), NULL);
        kmp_linear_follow(&v->linear, &change, &(kmp_response){f->dq + k * f->n, f->dqd + k * f->n, NULL, NULL, NULL});
    }
    return KMP_GO;
}

/* Takes the place to the plant's charts, where it is (q, qd). */
static void enter_charts(forward *f, const double *q, const double *qd)
{
    const kmp_chart_motion from = {f->chart, f->q, f->qd, NULL}, to = {plant_of(f)->chart, q, qd, NULL};
    for (int c = 0; c < f->system->chart_count; c++)
        for (int k = 0; k < f->count && memcmp(from.chart + KMP_CHART_SIZE * c, to.chart + KMP_CHART_SIZE * c,
                                               KMP_CHART_SIZE * sizeof(double)) != 0;
             k++)
            kmp_chart_carry(f->system, c, &from, &to, f->dq + k * f->n, f->dqd + k * f->n, NULL);
    memcpy(f->chart, to.chart, chart_bytes(f));
    memcpy(f->q, q, (size_t)f->n * sizeof *q);
    memcpy(f->qd, qd, (size_t)f->n * sizeof *qd);
}

/* y, but for integrals, from the place. */
static void pack(forward *f, double *y)
{
    const int *of = unknowns_of(f);
    int half = blocks(f), w = f->width;
    for (int i = 0; i < w; i++) {
        y[i] = f->q[of[i]];
        y[half + i] = f->qd[of[i]];
        for (int k = 0; k < f->count; k++) {
            y[(k + 1) * w + i] = f->dq[k * f->n + of[i]];
            y[half + (k + 1) * w + i] = f->dqd[k * f->n + of[i]];
        }
    }
}

static void set_weights(forward *f)
{
    int half = blocks(f), w = f->width;
    double *atol = f->road.atol;
    for (int b = 0; b <= f->count; b++)
        for (int i = 0; i < w; i++) {
            double of = f->atol * f->system->scale[unknowns_of(f)[i]] / (b ? f->sizes[b - 1] : 1);
            atol[b * w + i] = of;
            atol[half + b * w + i] = of * f->rate_scale;
        }
    for (int b = 0; b < f->integrals; b++)
        atol[2 * half + b] = f->atol * f->ask->spec->t_end / (b ? f->sizes[b - 1] : 1);
}

/* Signs of Jv's blocks, predictions and conditions, from the last state on; whether u is still a good choice. */
static void settle(forward *f)
{
    kmp_linear *l = &f->v->linear;
    int row, column;
    memcpy(f->mode, l->plant->mode, mode_bytes(f));
    kmp_varied_anchor(f->v);
    f->crossed = false;
    if (l->red.r == 0)
        return;
    kmp_block_take_signs(l->red.block, f->signs);
    f->growth = kmp_reduction_growth(&l->red, &row, &column);
    f->due = !f->fixed && !f->zone && f->growth > KMP_EXCHANGE_CLOSED;
}

/* -- a zone ------------------------------------------------------------------------------------------ */

/* The last state, all of it, into the unknowns that led to it. */
static void put_closed(forward *f, double *y)
{
    kmp_varied *v = f->v;
    const kmp_linear *l = &v->linear;
    int n = f->n, half = blocks(f);
    if (f->count > 0)
        kmp_varied_parts(v);
    for (int k = 0; k < f->count; k++) {
        double *dq = y + (k + 1) * n, *dqd = y + half + (k + 1) * n;
        kmp_change change = kmp_varied_change(v, k, position_of(f, y, k), rate_of(f, y, k), NULL);
        kmp_linear_follow(&v->linear, &change, &(kmp_response){.q = dq, .qd = dqd});
    }
    memcpy(y, l->q, (size_t)n * sizeof *y);
    memcpy(y + half, l->qd, (size_t)n * sizeof *y);
}

static int closed(void *self, double t, double *y, bool as_it_is, double *dy, double *distance)
{
    forward *f = self;
    if (!dy)
        kmp_plant_closure(plant_of(f), t, y);
    else if (come_to(f, t, y) != KMP_GO)
        return KMP_RETRY;
    if (dy && !as_it_is)
        put_closed(f, y);
    if (dy)
        give(f, y, dy);
    if (distance)
        *distance = kmp_margin_at(f->margin, plant_of(f));
    return KMP_GO;
}

static void say_change_point(forward *f, double t)
{
    kmp_text_printf(&f->road.reason,
                    "the mechanism comes to a change point near t = %.9g, where branches of it meet: %s", t,
                    f->ask->alone ? "the adjoint method does not go through it, the forward method may"
                                  : "parameters that move its closures have no derivative beyond");
}

/* -- the end of a step ------------------------------------------------------------------------------- */

/* It must not have jumped a dead centre of u; evaluated last. */
static int accept(void *self, double t, double *y, const double *dy, const double *w)
{
    forward *f = self;
    const kmp_linear *l = &f->v->linear;
    const char *joint = f->own_angles ? kmp_varied_singular(f->v) : NULL;
    (void)dy, (void)w;
    if (joint) {
        kmp_text_printf(
            &f->road.reason,
            "the angles of spherical joint '%s' come near to their singular position at t = %.9g: integrals of "
            "these angles do not go on there; take rows of them, or give the joint other axes",
            joint, t);
        return KMP_HALT;
    }
    if (f->zone) {
        put_closed(f, y);
        kmp_varied_anchor(f->v);
        return KMP_GO;
    }
    if (l->red.r > 0) {
        kmp_block_take_signs(l->red.block, f->signs_now);
        size_t count = (size_t)kmp_block_count(l->red.block);
        bool crosses = memcmp(f->signs, f->signs_now, count * sizeof *f->signs) != 0;
        f->crossed = f->crossed || crosses;
        if (crosses || kmp_varied_miss(f->v, y) > FARTHEST)
            return KMP_RETRY;
    }
    if (f->ask->alone && l->red.r > 0 && kmp_margin_at(f->margin, l->plant) < PASSING) {
        say_change_point(f, t);
        return KMP_HALT;
    }
    int said = kmp_redundant_check(l->plant, &l->part, t, f->atol + f->rtol, &f->road.reason);
    if (said == KMP_GO && kmp_margin_refuses(f->margin, l->plant, t))
        said = KMP_RETRY;
    if (said == KMP_GO)
        settle(f);
    return said;
}

static void explain(kmp_road *road)
{
    forward *f = (forward *)road;
    double t = f->v->anchor[0].t;
    kmp_plant_closure(plant_of(f), t, f->v->anchor[0].q);
    if (f->zone || f->crossed || (f->growth < FOLDED && kmp_margin_at(f->margin, plant_of(f)) < CHANGE_POINT))
        say_change_point(f, t);
    else if (f->growth >= FOLDED)
        kmp_text_printf(&road->reason,
                        "the independent coordinates come to a dead centre at t = %.9g: |dv/du| has grown to %.3g", t,
                        f->growth);
}

/* The place is that before a mark. */
static void keep_old(forward *f)
{
    const int *u = f->v->linear.part.u;
    for (int i = 0; i < f->p; i++) {
        f->old_u[i] = u[i];
        f->old_y[i] = f->q[u[i]];
        f->old_y[f->p + i] = f->qd[u[i]];
    }
    memcpy(f->old_q, f->q, (size_t)f->n * sizeof *f->q);
    memcpy(f->old_chart, f->chart, chart_bytes(f));
}

static bool charts_differ(const forward *f, const double *chart)
{
    return memcmp(chart, plant_of(f)->chart, chart_bytes(f)) != 0;
}

/* The place is that behind it. */
static int tell_mark(forward *f, double t, int condition)
{
    kmp_varied_mark mark = {t, condition, f->old_u, f->old_q, f->old_y, f->mode, f->old_chart, {0}};
    if (charts_differ(f, f->old_chart))
        mark.next = (kmp_chart_motion){f->chart, f->q, f->qd, NULL};
    int said = f->ask->watch.mark ? f->ask->watch.mark(f->ask->watch.user, &mark) : 0;
    if (said)
        (void)kmp_fail_memory(f->system->context);
    return said ? KMP_HALT : KMP_GO;
}

/* Other coordinates of the place, where the plant is, as independent ones: as many, anew. */
static int choose_anew(forward *f, double *y)
{
    kmp_linear *l = &f->v->linear;
    kmp_partition part;
    kempe_status status = kmp_partition_of_rank(&part, f->system, l->plant->jacobian, l->part.r, NULL, 0);
    if (status != KEMPE_OK || kmp_varied_take(f->v, f->t, f->q, &part) != KEMPE_OK)
        return KMP_HALT;
    pack(f, y);
    set_weights(f);
    if (stand_at(f, f->t, y, false) != KMP_GO)
        return KMP_HALT;
    settle(f);
    f->due = false; /* there is no better choice */
    return KMP_GO;
}

static int renew(kmp_road *road, double t, double *y, double *yp)
{
    forward *f = (forward *)road;
    (void)yp;
    if (!f->due)
        return KMP_GO;
    if (spread(f, t, y) != KMP_GO)
        return KMP_HALT;
    keep_old(f);
    if (choose_anew(f, y) != KMP_GO || tell_mark(f, t, -1) != KMP_GO)
        return KMP_HALT;
    road->exchanges += memcmp(f->old_u, f->v->linear.part.u, (size_t)f->p * sizeof *f->old_u) != 0;
    return KMP_CHANGED;
}

/* -- conditions -------------------------------------------------------------------------------------- */

static void set_modes(const forward *f, const double *mode)
{
    for (int k = 0; k < f->system->events.count; k++)
        if ((plant_of(f)->mode[k] != 0) != (mode[k] != 0))
            kmp_plant_set_mode(plant_of(f), k, mode[k] != 0);
}

/* dt_e/dp of condition k at the place, which is the last state. false: it is not passed but touched. */
static bool find_swing(forward *f, int k)
{
    kmp_varied *v = f->v;
    kmp_linear *l = &v->linear;
    double one = 1, *along = f->along, rate, faster;
    kmp_instant at = kmp_linear_instant(&v->linear);
    (void)kmp_slopes_values(&v->slopes->events, &at);
    kmp_slopes_along(v->slopes, &v->slopes->events, &(kmp_direction){&one, l->qd, l->qdd, NULL, NULL, NULL}, along);
    rate = along[k];
    kmp_slopes_along(v->slopes, &v->slopes->events, &(kmp_direction){NULL, NULL, l->qdd, NULL, NULL, NULL}, along);
    faster = fabs(along[k]) + fabs(rate - along[k]);
    for (int i = 0; i < f->count; i++) {
        f->unit[i] = 1;
        kmp_slopes_along(v->slopes, &v->slopes->events,
                         &(kmp_direction){NULL, f->dq + i * f->n, f->dqd + i * f->n, NULL, NULL, f->unit}, along);
        f->unit[i] = 0;
        f->swing[i] = -along[k] / rate;
    }
    return fabs(rate) > GRAZING * faster;
}

static double integrand_here(forward *f)
{
    return f->integrals ? kmp_target_value(f->ask->integrand, f->v) : 0;
}

/* What is before less what is behind, times dt_e/dp. */
static void jump(forward *f, double integrand_before, double *y)
{
    const kmp_linear *l = &f->v->linear;
    int half = blocks(f);
    double integrand = integrand_before - integrand_here(f);
    for (int i = 0; i < f->width; i++)
        f->before[i] -= l->qdd[unknowns_of(f)[i]];
    for (int k = 0; k < f->count; k++) {
        for (int i = 0; i < f->width; i++)
            y[half + (k + 1) * f->width + i] += f->before[i] * f->swing[k];
        if (f->integrals)
            y[2 * half + 1 + k] += integrand * f->swing[k];
    }
}

static int fail_at(forward *f, const char *sentence, int k, double t)
{
    kmp_text_printf(&f->road.reason, sentence, f->system->event_text[k], t);
    return KMP_HALT;
}

/* Condition k changes, and with it what `mode` says of others. */
static int pass(forward *f, int k, const double *mode, double t, double *y)
{
    const kmp_linear *l = &f->v->linear;
    if (spread(f, t, y) != KMP_GO)
        return KMP_HALT;
    if (f->count > 0 && !find_swing(f, k))
        return fail_at(f,
                       "the condition %s is touched at t = %.9g, not passed: the motion has no derivative by "
                       "parameters there",
                       k, t);
    keep_old(f);
    memcpy(f->mode, l->plant->mode, mode_bytes(f));
    double integrand = integrand_here(f);
    for (int i = 0; i < f->width; i++)
        f->before[i] = l->qdd[unknowns_of(f)[i]];
    set_modes(f, mode);
    if (come_to(f, t, y) != KMP_GO)
        return fail_at(f, "the motion cannot go on behind the condition %s at t = %.9g", k, t);
    jump(f, integrand, y);
    f->t = NAN; /* the place is that before */
    return tell_mark(f, t, k);
}

/* Conditions have changed since the last start: those that the motion itself has changed in turn, the last of them with
 * all that follow. */
static int pass_conditions(forward *f, double t, double *y)
{
    const kmp_linear *l = &f->v->linear;
    int count = f->system->events.count, last = -1, said = KMP_GO;
    memcpy(f->new_mode, l->plant->mode, mode_bytes(f));
    memcpy(f->next_mode, f->mode, mode_bytes(f));
    set_modes(f, f->mode);
    if (stand_at(f, t, y, false) != KMP_GO)
        return KMP_HALT;
    kmp_plant_all_changes(l->plant, t, l->q, l->qd, l->qdd, l->lambda, f->changes);
    for (int k = 0; k < count; k++) {
        bool changes = (f->new_mode[k] != 0) != (f->mode[k] != 0);
        f->cause[k] = changes && (f->changes[k] < 0) != (f->mode[k] != 0);
        last = f->cause[k] || (changes && last < 0) ? k : last;
    }
    f->cause[last] = true;
    for (int k = 0; said == KMP_GO && k <= last; k++)
        if (f->cause[k]) {
            f->next_mode[k] = f->new_mode[k];
            said = pass(f, k, k == last ? f->new_mode : f->next_mode, t, y);
        }
    return said;
}

/* -- charts ------------------------------------------------------------------------------------------ */

/* Joints have been centred: the place in the charts before, carried to where it is (q, qd) in those at hand. */
static int pass_charts(forward *f, double t, const double *q, const double *qd, double *y)
{
    memcpy(f->new_chart, plant_of(f)->chart, chart_bytes(f));
    kmp_plant_set_charts(plant_of(f), f->chart);
    if (spread(f, t, y) != KMP_GO)
        return KMP_HALT;
    kmp_plant_set_charts(plant_of(f), f->new_chart);
    keep_old(f);
    enter_charts(f, q, qd);
    if (tell_mark(f, t, -1) != KMP_GO)
        return KMP_HALT;
    keep_old(f);
    kmp_plant_closure(plant_of(f), t, q);
    if (!f->fixed && !f->zone)
        return choose_anew(f, y);
    pack(f, y);
    return KMP_GO;
}

static int resume(kmp_road *road, double t, const double *q, const double *qd, const double *qdd, const double *lambda,
                  double *y, double *yp)
{
    forward *f = (forward *)road;
    int half = blocks(f);
    (void)qdd, (void)lambda, (void)yp;
    if (f->system->events.count > 0 && memcmp(f->mode, plant_of(f)->mode, mode_bytes(f)) != 0 &&
        pass_conditions(f, t, y) != KMP_GO)
        return KMP_HALT;
    if (charts_differ(f, f->chart) && pass_charts(f, t, q, qd, y) != KMP_GO)
        return KMP_HALT;
    for (int i = 0; i < f->width; i++) {
        y[i] = q[unknowns_of(f)[i]];
        y[half + i] = qd[unknowns_of(f)[i]];
    }
    if (stand_at(f, t, y, false) != KMP_GO)
        return KMP_HALT;
    settle(f);
    return KMP_GO;
}

/* -- rows -------------------------------------------------------------------------------------------- */

static void position(kmp_road *road, double t, const double *y, double *q)
{
    forward *f = (forward *)road;
    if (f->zone)
        memcpy(q, y, (size_t)f->n * sizeof *q);
    else if (kmp_varied_position(f->v, t, y, q) != KMP_GO)
        memcpy(q, f->v->q, (size_t)f->n * sizeof *q);
}

static int row(kmp_road *road, double t, const double *y, const double *yp, double *q, double *qd, double *qdd,
               double *lambda, double *work)
{
    forward *f = (forward *)road;
    const kmp_linear *l = &f->v->linear;
    (void)yp;
    *work = 0;
    int said = qd || f->zone ? stand_at(f, t, y, qdd != NULL) : kmp_varied_position(f->v, t, y, q);
    if (said != KMP_GO) {
        if (road->reason.length == 0)
            kmp_text_printf(&road->reason, "the closures could not be solved at the output time t = %.9g", t);
        return KMP_HALT;
    }
    if (!qd && !f->zone)
        return KMP_GO;
    memcpy(q, l->q, (size_t)f->n * sizeof *q);
    if (qd)
        memcpy(qd, l->qd, (size_t)f->n * sizeof *qd);
    if (!qdd)
        return KMP_GO;
    memcpy(qdd, l->qdd, (size_t)f->n * sizeof *qdd);
    memcpy(lambda, l->lambda, (size_t)f->m * sizeof *lambda);
    f->row_y = y;
    return KMP_GO;
}

/* By parameter k what the last whole row makes: outputs, which see the charts there, and the user's coordinates. */
static void follow(forward *f, int k, const kmp_chart_motion *user)
{
    kmp_varied *v = f->v;
    const kmp_linear *l = &v->linear;
    const kmp_chart_motion inner = {l->plant->chart, l->q, l->qd, l->qdd};
    double *dq = f->dq + k * f->n, *dqd = f->dqd + k * f->n, *dqdd = f->dqdd + k * f->n;
    double *dlambda = f->dlambda + k * f->m;
    kmp_varied_follow(v, k, position_of(f, f->row_y, k), rate_of(f, f->row_y, k), dq, dqd, dqdd, dlambda);
    if (v->slopes->shown > 0)
        outputs_along(f, k, dq, dqd, dqdd, dlambda, f->dshown + k * v->slopes->shown);
    for (int c = 0; c < f->system->chart_count; c++)
        if (!kmp_chart_is_own(inner.chart, c))
            kmp_chart_carry(f->system, c, &inner, user, dq, dqd, dqdd);
}

static int take_row(void *user, double t, const double *q, const double *qd, const double *qdd, const double *lambda,
                    double work)
{
    forward *f = user;
    kmp_varied *v = f->v;
    const kmp_chart_motion own = {f->new_chart, q, qd, qdd};
    (void)work;
    if (!f->ask->watch.row)
        return 0;
    const kmp_instant at = kmp_linear_instant(&v->linear);
    const double *shown = kmp_slopes_values(&v->slopes->outputs, &at);
    kmp_charts_reset(f->system, f->new_chart);
    if (f->count > 0)
        kmp_varied_parts(v);
    for (int k = 0; k < f->count; k++)
        follow(f, k, &own);
    const kmp_varied_row row_of = {t, q, qd, qdd, lambda, shown, f->dq, f->dqd, f->dqdd, f->dlambda, f->dshown};
    return f->ask->watch.row(f->ask->watch.user, &row_of);
}

static int take_step(void *user, kmp_runner *runner, double from, double to)
{
    forward *f = user;
    const double *y = f->integrals ? kmp_runner_unknowns(runner, to) : NULL;
    if (f->integrals && !y)
        return 1;
    if (y)
        memcpy(f->tail, y + 2 * blocks(f), (size_t)f->integrals * sizeof *y);
    return f->ask->watch.step && to > from ? f->ask->watch.step(f->ask->watch.user, runner, from, to) : 0;
}

/* -- the road ---------------------------------------------------------------------------------------- */

/* v goes by another plant from now on. */
static void go_by(forward *f, kmp_plant *plant)
{
    kmp_linear_lend(&f->v->linear, plant);
    kmp_linear_renew_parameters(&f->v->linear);
    kmp_slopes_renew_parameters(f->v->slopes);
}

/* The own plant has the charts and conditions of the runner's then. */
static void release(kmp_road *road)
{
    forward *f = (forward *)road;
    const kmp_plant *plant = plant_of(f);
    kmp_free(road->y);
    kmp_free(road->atol);
    road->y = road->atol = NULL;
    if (plant == f->own)
        return;
    kmp_plant_set_charts(f->own, plant->chart);
    for (int k = 0; k < f->system->events.count; k++)
        kmp_plant_set_mode(f->own, k, plant->mode[k] != 0);
    go_by(f, f->own);
}

static int keep(kmp_road *road, double t, const double *y)
{
    forward *f = (forward *)road;
    memcpy(f->tail, y + 2 * blocks(f), (size_t)f->integrals * sizeof *y);
    if (!(f->t >= t) && spread(f, t, y) != KMP_GO) /* charts have changed, and the place with them */
        return KMP_HALT;
    keep_old(f);
    return KMP_GO;
}

static bool make_unknowns(forward *f)
{
    kmp_road *road = &f->road;
    f->width = f->zone ? f->n : f->p;
    road->size = 2 * blocks(f) + f->integrals;
    road->rtol = f->zone ? fmax(f->rtol, ZONE_RTOL) : 0;
    road->y = KMP_NEW(double, road->size);
    road->atol = KMP_NEW(double, road->size);
    road->ode = (kmp_ode){.n = road->size,
                          .self = f,
                          .rhs = rhs,
                          .accept = accept,
                          .jacobian = jacobian,
                          .closed = closed,
                          .positions = blocks(f),
                          .quadratures = f->integrals};
    return road->y && road->atol;
}

/* A start that is neither the first one nor where the last road was left: what came between has changed rates. */
static kempe_status check_place(forward *f, const kmp_road_start *start)
{
    int k = 0;
    while (k < f->system->events.count && (f->mode[k] != 0) == (start->plant->mode[k] != 0))
        k++;
    if (k < f->system->events.count)
        return kmp_fail(f->system->context, KEMPE_E_FAILED,
                        "closures switch where %s changes at t = %.9g: derivatives of rates that jump are not known",
                        f->system->event_text[k], start->t);
    if (start->part->p != f->p || start->t > f->t || start->t < f->t)
        return kmp_fail(f->system->context, KEMPE_E_FAILED,
                        "derivatives by parameters do not go on at t = %.9g, where the freedoms are %d, not %d",
                        start->t, start->part->p, f->p);
    return KEMPE_OK;
}

static kempe_status begin(forward *f, const kmp_road_start *start)
{
    kmp_partition part;
    kempe_status status = f->begun ? check_place(f, start) : KEMPE_OK;
    if (status != KEMPE_OK)
        return status;
    bool first = !f->begun;
    f->begun = true;
    f->p = start->part->p;
    f->redundant = start->part->m - start->part->r;
    if (!make_unknowns(f) || !kmp_partition_copy(&part, start->part))
        return kmp_fail_memory(f->system->context);
    go_by(f, start->plant);
    f->v->linear.held = true;
    f->v->linear.plain = f->count == 0;
    status = kmp_varied_take(f->v, start->t, start->q, &part);
    if (status != KEMPE_OK)
        return status;
    enter_charts(f, start->q, start->qd);
    pack(f, f->road.y);
    memcpy(f->road.y + 2 * blocks(f), f->tail, (size_t)f->integrals * sizeof *f->tail);
    set_weights(f);
    if (stand_at(f, start->t, f->road.y, false) != KMP_GO)
        return kmp_fail(f->system->context, KEMPE_E_FAILED,
                        "the start cannot be evaluated: its closures are singular, or a coordinate moves no mass");
    settle(f);
    bool marked = !first || charts_differ(f, f->old_chart);
    return !marked || tell_mark(f, start->t, -1) == KMP_GO ? KEMPE_OK : KEMPE_E_MEMORY;
}

static const kmp_road_kind varied_zone;

static kmp_road *create(const kmp_road_kind *kind, const kmp_road_start *start)
{
    forward *f = start->user;
    f->zone = kind == &varied_zone;
    f->margin = start->margin;
    f->fixed = start->fixed;
    f->rtol = start->rtol;
    f->atol = start->atol;
    f->rate_scale = start->rate_scale;
    f->road.exchanges = 0;
    kmp_text_free(&f->road.reason);
    if (begin(f, start) == KEMPE_OK)
        return &f->road;
    release(&f->road);
    return NULL;
}

static const kmp_road_kind varied_zone = {.road = "varied", .form = "zone", .corrected = true, .create = create};
static const kmp_road_kind varied_road = {
    .road = "varied", .form = "closed", .corrected = true, .zone = &varied_zone, .create = create};

/* -- the run ----------------------------------------------------------------------------------------- */

static bool make_room(forward *f)
{
    kmp_arena *a = &f->arena;
    size_t n = (size_t)f->n, slopes = n * (size_t)f->v->count, conditions = (size_t)f->system->events.count;
    const struct {
        double **to;
        size_t size;
    } rooms[] = {{&f->q, n},
                 {&f->qd, n},
                 {&f->dq, slopes},
                 {&f->dqd, slopes},
                 {&f->dqdd, slopes},
                 {&f->dlambda, (size_t)f->m * (size_t)f->v->count},
                 {&f->dshown, (size_t)f->v->slopes->shown * (size_t)f->v->count},
                 {&f->swing, (size_t)f->v->count},
                 {&f->unit, (size_t)f->v->count},
                 {&f->mode, conditions},
                 {&f->new_mode, conditions},
                 {&f->next_mode, conditions},
                 {&f->changes, conditions},
                 {&f->along, conditions},
                 {&f->chart, chart_bytes(f) / sizeof(double)},
                 {&f->new_chart, chart_bytes(f) / sizeof(double)},
                 {&f->su, n},
                 {&f->sud, n},
                 {&f->ud, n},
                 {&f->before, n},
                 {&f->old_q, n},
                 {&f->old_y, 2 * n},
                 {&f->old_chart, chart_bytes(f) / sizeof(double)},
                 {&f->matrix, 2 * n * n},
                 {&f->tail, (size_t)f->integrals}};
    for (size_t k = 0; k < sizeof rooms / sizeof *rooms; k++)
        *rooms[k].to = KMP_ARENA_NEW(a, double, rooms[k].size);
    f->signs = KMP_ARENA_NEW(a, int, n);
    f->signs_now = KMP_ARENA_NEW(a, int, n);
    f->old_u = KMP_ARENA_NEW(a, int, n);
    f->every = KMP_ARENA_NEW(a, int, n);
    f->cause = KMP_ARENA_NEW(a, bool, conditions);
    for (int i = 0; !a->failed && i < f->n; i++)
        f->every[i] = i;
    return !a->failed;
}

/* The start and its slopes into the place. */
static kempe_status prepare(forward *f)
{
    kmp_varied *v = f->v;
    size_t slopes = (size_t)(f->n * v->count) * sizeof(double);
    if (!make_room(f))
        return kmp_fail_memory(f->system->context);
    kmp_charts_reset(f->system, f->chart);
    kmp_plant_set_charts(f->own, f->chart);
    go_by(f, f->own);
    v->linear.plain = false;
    kempe_status status = kmp_varied_start(v, f->q, f->qd, f->dq, f->dqd);
    if (status == KEMPE_OK && f->ask->start_q)
        memcpy(f->ask->start_q, f->dq, slopes);
    if (status == KEMPE_OK && f->ask->start_qd)
        memcpy(f->ask->start_qd, f->dqd, slopes);
    f->p = v->linear.p;
    if (status == KEMPE_OK && v->linear.chosen)
        keep_old(f);
    return status;
}

/* Whether it is of coordinates of spherical joints themselves, which are others in each chart. */
static bool reads_angles(const kempe_system *s, const kmp_target *target)
{
    const double *part[] = {target->q, target->qd, target->qdd};
    bool reads = false;
    for (int k = 0; k < 9 * s->chart_count; k++)
        reads = reads || (part[k % 3] && part[k % 3][s->chart_first[k / 9] + k / 3 % 3] != 0);
    return reads;
}

static kempe_status run(forward *f, kmp_forward_report *report)
{
    kmp_run_spec spec = *f->ask->spec;
    kempe_status status = prepare(f);
    const kempe_assembly start = {.system = f->system, .q = f->q, .qd = f->qd, .closed = true};
    spec.kind = &varied_road;
    spec.user = f;
    spec.step = take_step;
    spec.own_angles = f->own_angles = f->ask->integrand && reads_angles(f->system, f->ask->integrand);
    if (f->ask->alone)
        spec.change_points = kmp_change_points_word(KMP_CHANGE_POINTS_IGNORE);
    if (status == KEMPE_OK)
        status = kmp_run(f->system, &spec, &start, take_row, f, &report->run);
    report->integral = f->integrals && f->tail ? f->tail[0] : 0;
    report->redundant = f->redundant;
    if (report->run.reason || (status != KEMPE_E_FAILED && status != KEMPE_STOPPED))
        return status;
    report->run.reason = kmp_strdup(kempe_context_message(f->system->context));
    return report->run.reason ? status : kmp_fail_memory(f->system->context);
}

kempe_status kmp_forward_run(kmp_varied *varied, const kmp_forward *ask, const double *sizes, double *integral,
                             kmp_forward_report *report)
{
    forward f = {.road = {.release = release,
                          .row = row,
                          .position = position,
                          .renew = renew,
                          .resume = resume,
                          .keep = keep,
                          .explain = explain},
                 .v = varied,
                 .own = varied->linear.plant,
                 .ask = ask,
                 .system = varied->system,
                 .sizes = sizes,
                 .n = varied->n,
                 .m = varied->m,
                 .count = ask->alone ? 0 : varied->count};
    f.integrals = ask->integrand ? 1 + f.count : 0;
    *report = (kmp_forward_report){0};
    kempe_status status = run(&f, report);
    for (int k = 0; integral && f.integrals && f.tail && k < f.count; k++)
        integral[k] = f.tail[1 + k];
    kmp_text_free(&f.road.reason);
    kmp_arena_free(&f.arena);
    varied->linear.plain = false;
    return status;
}
