/* SPDX-License-Identifier: BSD-3-Clause */
/* The zone around a change point, where J loses a row: the projected road with directions of the constraint forces that
 * are nearly dependent left out (constraints/saddle.h), so that the motion goes on along the tangent it has, with an
 * error of the order of eps^2. A runner enters the zone when the margin of the closures has fallen and leaves it when
 * it has grown again; no other road may be asked to cross.
 */
#include "base/arena.h"
#include "base/memory.h"
#include "constraints/tolerances.h"
#include "integrators/road.h"
#include <math.h>
#include <string.h>

/* Directions below this fraction of the strongest are left out: where the motion goes straight on, and where it turns
 * near the change point, which their reactions make it do. */
#define EPS       1e-5
#define EPS_TURNS 1e-7
/* Away from the change point none is left out but what is nothing. */
#define NOTHING 1e-13
/* A state is closed by so many corrections; one below this part of the margin, or of a scaled |h| that is rounding
 * alone, is the last. */
#define LAST_CORRECTION 1e-8
enum { CLOSE_PASSES = 8 };
/* Nothing finer is to be had in the zone. */
#define ZONE_RTOL 1e-9

typedef struct zone {
    kmp_road road; /* first */
    kmp_arena arena;
    const kempe_system *s;
    kmp_plant *plant;
    kmp_margin *margin;
    double eps_march; /* of the right-hand side */
    bool has_work;
    int n, m;
    double *lambda; /* m: where closures move */
    double *x, *y, *dx;
    kmp_saddle saddle; /* truncated */
} zone;

/* M and J of the plant factored. */
static int factor(zone *d, double eps)
{
    d->saddle.eps = eps;
    int failed = kmp_saddle_factor(&d->saddle);
    d->road.factorizations = d->saddle.factorizations;
    return failed ? KMP_RETRY : KMP_GO;
}

static int place(zone *d, double t, const double *q)
{
    kmp_plant_closure(d->plant, t, q);
    kmp_plant_mass(d->plant);
    return factor(d, d->eps_march);
}

/* dy from the factors and the plant's last bias. */
static void give(zone *d, const double *y, double *dy)
{
    int n = d->n;
    memcpy(dy, y + n, (size_t)n * sizeof *dy);
    kmp_saddle_accelerations(&d->saddle, dy + n, d->s->rheonomic ? d->lambda : NULL);
    if (d->has_work)
        dy[2 * n] = kmp_plant_power_here(d->plant, y + n) + kmp_plant_drive_power(d->plant, d->lambda);
}

static int rhs(void *self, double t, const double *y, double *dy)
{
    zone *d = self;
    int n = d->n;
    if (place(d, t, y) != KMP_GO)
        return KMP_RETRY;
    kmp_plant_bias(d->plant, y + n);
    give(d, y, dy);
    for (int i = 0; i < n; i++)
        if (!isfinite(dy[n + i]))
            return KMP_RETRY;
    return KMP_GO;
}

/* dx in coordinate scales. */
static double size_of(const zone *d, const double *dx)
{
    double size = 0;
    for (int i = 0; i < d->n; i++)
        size = isfinite(dx[i]) ? fmax(size, fabs(dx[i]) / d->s->scale[i]) : INFINITY;
    return size;
}

/* M and J at (t, q) factored with nothing left out, q brought onto the closures before. */
static int close_positions(zone *d, double t, double *q, bool as_it_is)
{
    bool last = as_it_is;
    for (int pass = 0; pass < CLOSE_PASSES; pass++) {
        kmp_plant_closure(d->plant, t, q);
        kmp_plant_mass(d->plant);
        if (factor(d, NOTHING) != KMP_GO)
            return KMP_RETRY;
        if (last)
            return KMP_GO;
        if (d->saddle.kept < d->saddle.r)
            return KMP_RETRY;
        kmp_saddle_correction(&d->saddle, d->plant->h, d->dx);
        double size = size_of(d, d->dx);
        last = size <= LAST_CORRECTION * d->saddle.last || kmp_plant_residual(d->plant) <= KMP_CLOSED;
        for (int i = 0; i < d->n; i++)
            q[i] += d->dx[i];
        if (!(size < INFINITY))
            return KMP_RETRY;
    }
    return KMP_RETRY;
}

static void turns(void *self, bool found)
{
    ((zone *)self)->eps_march = found ? EPS_TURNS : EPS;
}

/* For the integrator that leaps: the state closed, and its accelerations with all directions. */
static int closed(void *self, double t, double *y, bool as_it_is, double *dy, double *distance)
{
    zone *d = self;
    int n = d->n;
    if (!dy)
        kmp_plant_closure(d->plant, t, y);
    else if (close_positions(d, t, y, as_it_is) != KMP_GO)
        return KMP_RETRY;
    if (dy && !as_it_is) {
        kmp_plant_rates(d->plant, y + n, d->y);
        kmp_saddle_correction(&d->saddle, d->y, d->x);
        for (int i = 0; i < n; i++)
            y[n + i] += d->x[i];
    }
    if (dy) {
        kmp_plant_bias(d->plant, y + n);
        give(d, y, dy);
    }
    if (distance)
        *distance = kmp_margin_at(d->margin, d->plant);
    return dy && !(size_of(d, dy + n) < INFINITY) ? KMP_RETRY : KMP_GO;
}

static int accept(void *self, double t, double *y, const double *dy, const double *w)
{
    zone *d = self;
    int n = d->n;
    (void)t, (void)dy, (void)w;
    kmp_saddle_correction(&d->saddle, d->plant->h, d->dx);
    kmp_plant_rates(d->plant, y + n, d->y);
    kmp_saddle_correction(&d->saddle, d->y, d->x);
    for (int i = 0; i < n; i++) {
        y[i] += d->dx[i];
        y[n + i] += d->x[i];
    }
    return KMP_GO;
}

static void position(kmp_road *road, double t, const double *y, double *q)
{
    (void)t;
    memcpy(q, y, (size_t)((zone *)road)->n * sizeof *q);
}

/* Projected to round-off on the directions kept, as the next road wants it. */
static int row(kmp_road *road, double t, const double *y, const double *yp, double *q, double *qd, double *qdd,
               double *lambda, double *work)
{
    zone *d = (zone *)road;
    int n = d->n;
    const kmp_closer closer = kmp_saddle_closer(&d->saddle, d->dx);
    (void)yp;
    memcpy(q, y, (size_t)n * sizeof *q);
    qd = qd ? qd : d->x;
    memcpy(qd, y + n, (size_t)n * sizeof *qd);
    d->saddle.eps = d->eps_march;
    if (!kmp_close_state(&closer, d->y, t, q, qd))
        return KMP_HALT;
    d->road.factorizations = d->saddle.factorizations;
    if (qdd) {
        kmp_plant_bias(d->plant, qd);
        kmp_saddle_accelerations(&d->saddle, qdd, lambda);
    }
    *work = d->has_work ? y[2 * n] : 0;
    return KMP_GO;
}

static int resume(kmp_road *road, double t, const double *q, const double *qd, const double *qdd, const double *lambda,
                  double *y, double *yp)
{
    const zone *d = (const zone *)road;
    (void)t, (void)qdd, (void)lambda, (void)yp;
    memcpy(y, q, (size_t)d->n * sizeof *y);
    memcpy(y + d->n, qd, (size_t)d->n * sizeof *y);
    return KMP_GO;
}

static void release(kmp_road *road)
{
    zone *d = (zone *)road;
    kmp_saddle_free(&d->saddle);
    kmp_arena_free(&d->arena);
    kmp_text_free(&road->reason);
    kmp_free(d);
}

static bool allocate(zone *d, const kmp_partition *part)
{
    kmp_arena *a = &d->arena;
    d->road.y = KMP_ARENA_NEW(a, double, d->road.size);
    d->road.atol = KMP_ARENA_NEW(a, double, d->road.size);
    d->x = KMP_ARENA_NEW(a, double, d->n);
    d->y = KMP_ARENA_NEW(a, double, d->m);
    d->dx = KMP_ARENA_NEW(a, double, d->n);
    d->lambda = KMP_ARENA_NEW(a, double, d->m);
    return !a->failed && kmp_saddle_init_truncated(&d->saddle, d->plant, part);
}

static kmp_road *create(const kmp_road_start *start)
{
    zone *d = KMP_NEW(zone, 1);
    if (!d) {
        (void)kmp_fail_memory(start->system->context);
        return NULL;
    }
    int n = start->part->n;
    d->s = start->system;
    d->plant = start->plant;
    d->margin = start->margin;
    d->eps_march = EPS;
    d->n = n;
    d->m = start->part->m;
    d->has_work = start->system->dissipative;
    d->road.release = release;
    d->road.row = row;
    d->road.position = position;
    d->road.resume = resume;
    d->road.size = 2 * n + d->has_work;
    d->road.rtol = fmax(start->rtol, ZONE_RTOL);
    d->road.ode = (kmp_ode){
        .n = d->road.size, .self = d, .rhs = rhs, .accept = accept, .closed = closed, .turns = turns, .positions = n};
    if (!allocate(d, start->part)) {
        (void)kmp_fail_memory(start->system->context);
        release(&d->road);
        return NULL;
    }
    double atol = fmax(start->atol, ZONE_RTOL);
    for (int i = 0; i < n; i++) {
        d->road.y[i] = start->q[i];
        d->road.y[n + i] = start->qd[i];
        d->road.atol[i] = atol * d->s->scale[i];
        d->road.atol[n + i] = d->road.atol[i] * start->rate_scale;
    }
    if (d->has_work) {
        d->road.y[2 * n] = start->work;
        d->road.atol[2 * n] = 1e300; /* judged, not controlled */
    }
    return &d->road;
}

const kmp_road_kind kmp_road_zone = {.road = "zone", .form = "none", .corrected = true, .create = create};
