/* SPDX-License-Identifier: BSD-3-Clause */
/* The zone around a change point, where J loses a row: the projected road with directions of the constraint forces that
 * are nearly dependent left out. With M = L L' and A = L^-1 J', A P = Q R by column pivoting, kept while |R_kk| > eps
 * |R_11|:
 *
 *     w = L' qdd = a + Q z,   a = -L^-1 C,   R' z = P'(-jdqd - A' a),   lambda = P R^-1 z
 *
 * so that the motion goes on along the tangent it has, with an error of the order of eps^2. A runner enters the zone
 * when the margin of the closures has fallen and leaves it when it has grown again; no other road may be asked to
 * cross.
 *
 * In a large mechanism rows of J are left out instead, those that complete pivoting of the scaled J finds below eps,
 * and the saddle system of the others is solved, sparse: the same equations on the rows that stay. */
#include "base/memory.h"
#include "constraints/pick.h"
#include "constraints/pressing.h"
#include "constraints/tolerances.h"
#include "integrators/closing.h"
#include "integrators/road.h"
#include "linalg/dense.h"
#include "linalg/dot.h"
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
    const kempe_system *s;
    kmp_plant *plant;
    const kmp_partition *part;
    kmp_margin *margin;
    double eps, eps_march; /* at hand; of the right-hand side */
    bool has_work;
    int n, m, r;
    int kept;       /* columns */
    double last;    /* the last one kept, of the first */
    double *l;      /* n x n Cholesky factor of M */
    double *a;      /* n x r: A, then Q in its kept columns */
    double *full;   /* n x r: A as it was */
    double *rr;     /* r x r, upper */
    int *pivot;     /* column of A in each place */
    double *lambda; /* m: where closures move */
    double *none;   /* m zeros */
    double *x, *y, *z, *dx;
    kmp_saddle saddle; /* of a large mechanism, in place of l, a, full, rr, pivot, z */
    kmp_order *order;
    bool large;
    int *entry_row, *entry_col;
    double *entry;
} zone;

/* x <- L^-1 x, x <- L^-T x */
static void forward(const zone *d, double *x)
{
    for (int i = 0; i < d->n; i++) {
        for (int k = 0; k < i; k++)
            x[i] -= d->l[i + k * d->n] * x[k];
        x[i] /= d->l[i + i * d->n];
    }
}

static void backward(const zone *d, double *x)
{
    for (int i = d->n - 1; i >= 0; i--) {
        for (int k = i + 1; k < d->n; k++)
            x[i] -= d->l[k + i * d->n] * x[k];
        x[i] /= d->l[i + i * d->n];
    }
}

static void swap_columns(zone *d, int i, int k)
{
    int p = d->pivot[i];
    d->pivot[i] = d->pivot[k];
    d->pivot[k] = p;
    for (int j = 0; j < d->n; j++) {
        double t = d->a[j + i * d->n];
        d->a[j + i * d->n] = d->a[j + k * d->n];
        d->a[j + k * d->n] = t;
    }
    for (int j = 0; j < i; j++) {
        double t = d->rr[j + i * d->r];
        d->rr[j + i * d->r] = d->rr[j + k * d->r];
        d->rr[j + k * d->r] = t;
    }
}

/* Gram-Schmidt with pivoting, each column orthogonalised twice (Golub and Van Loan, 5.2.8, 5.4.2). */
static void factor_columns(zone *d)
{
    int n = d->n, r = d->r;
    double first = 0;
    memset(d->rr, 0, (size_t)(r * r) * sizeof *d->rr);
    for (int k = 0; k < r; k++)
        d->pivot[k] = k;
    for (d->kept = 0; d->kept < r; d->kept++) {
        int k = d->kept, best = k;
        double most = -1;
        for (int j = k; j < r; j++) {
            double size = kmp_dot(n, d->a + j * n, d->a + j * n);
            if (size > most * (1 + 1e-12)) {
                most = size;
                best = j;
            }
        }
        swap_columns(d, k, best);
        double *q = d->a + k * n;
        for (int j = 0; j < k; j++) { /* once more against those kept */
            double again = kmp_dot(n, d->a + j * n, q);
            d->rr[j + k * r] += again;
            for (int i = 0; i < n; i++)
                q[i] -= again * d->a[i + j * n];
        }
        double size = sqrt(kmp_dot(n, q, q));
        first = k == 0 ? size : first;
        if (!(size > d->eps * first))
            return;
        d->rr[k + k * r] = size;
        for (int i = 0; i < n; i++)
            q[i] /= size;
        for (int j = k + 1; j < r; j++) {
            double along = kmp_dot(n, q, d->a + j * n);
            d->rr[k + j * r] = along;
            for (int i = 0; i < n; i++)
                d->a[i + j * n] -= along * q[i];
        }
    }
}

/* Rows that are nearly dependent out of the saddle system, which is then factored. */
static int factor_large(zone *d)
{
    const kmp_pattern *jac = &d->s->jacobian;
    int nz = 0;
    for (int k = 0; k < jac->count; k++) {
        int row = d->saddle.position[jac->row[k]];
        if (row < 0)
            continue;
        d->entry_row[nz] = row;
        d->entry_col[nz] = jac->col[k];
        d->entry[nz++] = d->plant->jacobian[k] * d->s->scale[jac->col[k]] / d->s->row_scale[jac->row[k]];
    }
    kmp_entries a = {d->r, d->n, nz, d->entry_row, d->entry_col, d->entry};
    const int *r, *c;
    const double *pivots;
    double largest, least;
    if (!kmp_order_run(d->order, &a, d->r, &r, &c, &pivots))
        return KMP_RETRY;
    kmp_order_extremes(pivots, d->r, &largest, &least);
    d->kept = 0;
    for (int k = 0; k < d->r; k++) {
        bool keep = pivots[k] > d->eps * largest;
        d->saddle.out[r[k]] = !keep;
        d->kept += keep;
    }
    d->last = least / largest;
    d->road.factorizations++;
    return kmp_saddle_factor(&d->saddle) ? KMP_RETRY : KMP_GO;
}

static int row_index(const kmp_partition *part, int row)
{
    for (int k = 0; k < part->r; k++)
        if (part->rows[k] == row)
            return k;
    return -1;
}

/* M and J of the plant factored. */
static int factor(zone *d)
{
    const kmp_pattern *jac = &d->s->jacobian;
    if (d->large)
        return factor_large(d);
    kmp_plant_dense_mass(d->plant, d->l);
    if (kmp_cholesky_factor(d->n, d->l))
        return KMP_RETRY;
    memset(d->a, 0, (size_t)(d->n * d->r) * sizeof *d->a);
    for (int k = 0; k < jac->count; k++) {
        int row = row_index(d->part, jac->row[k]);
        if (row >= 0)
            d->a[jac->col[k] + row * d->n] = d->plant->jacobian[k];
    }
    for (int k = 0; k < d->r; k++)
        forward(d, d->a + k * d->n);
    memcpy(d->full, d->a, (size_t)(d->n * d->r) * sizeof *d->a);
    factor_columns(d);
    d->last = d->kept > 0 ? d->rr[(d->kept - 1) * (d->r + 1)] / d->rr[0] : 1;
    d->road.factorizations++;
    return KMP_GO;
}

/* z with R' z = the kept entries of -b - A' w, and w += Q z: the least change of w that gives A' w = -b. */
static void least_change(zone *d, const double *b, double *w)
{
    int n = d->n, r = d->r;
    for (int k = 0; k < d->kept; k++) {
        int row = d->pivot[k];
        double s = -b[d->part->rows[row]] - kmp_dot(n, d->full + row * n, w);
        for (int j = 0; j < k; j++)
            s -= d->rr[j + k * r] * d->z[j];
        d->z[k] = s / d->rr[k + k * r];
    }
    for (int k = 0; k < d->kept; k++)
        for (int i = 0; i < n; i++)
            w[i] += d->z[k] * d->a[i + k * n];
}

/* From z. */
static void take_multipliers(zone *d, double *lambda)
{
    int r = d->r;
    memset(lambda, 0, (size_t)d->m * sizeof *lambda);
    for (int k = d->kept - 1; k >= 0; k--) {
        for (int j = k + 1; j < d->kept; j++)
            d->z[k] -= d->rr[k + j * r] * d->z[j];
        d->z[k] /= d->rr[k + k * r];
        lambda[d->part->rows[d->pivot[k]]] = d->z[k];
    }
}

/* For forces that depend on multipliers. */
static void multipliers(void *self, const double *bias, bool change, double *lambda)
{
    zone *d = self;
    for (int i = 0; i < d->n; i++)
        d->dx[i] = -bias[i];
    forward(d, d->dx);
    least_change(d, change ? d->none : d->plant->jdqd, d->dx);
    take_multipliers(d, lambda);
}

static void accelerations(zone *d, double *qdd, double *lambda)
{
    int n = d->n;
    const kmp_answer pressed = {d, multipliers};
    if (d->large) {
        kmp_saddle_accelerations(&d->saddle, qdd, lambda);
        return;
    }
    bool settled = kmp_press(d->plant, &pressed);
    for (int i = 0; i < n; i++)
        qdd[i] = settled ? -d->plant->bias[i] : NAN;
    forward(d, qdd);
    least_change(d, d->plant->jdqd, qdd);
    backward(d, qdd);
    if (lambda)
        take_multipliers(d, lambda);
}

/* Mass-orthogonal dx with J dx = -violation on the kept directions. */
static void correction(void *self, const double *violation, double *dx)
{
    zone *d = self;
    if (d->large) {
        kmp_saddle_correction(&d->saddle, violation, dx);
        return;
    }
    memset(dx, 0, (size_t)d->n * sizeof *dx);
    least_change(d, violation, dx);
    backward(d, dx);
}

static int place(void *self, double t, const double *q)
{
    zone *d = self;
    d->eps = d->eps_march;
    kmp_plant_closure(d->plant, t, q);
    kmp_plant_mass(d->plant);
    return factor(d);
}

/* dy from the factors and the plant's last bias. */
static void give(zone *d, const double *y, double *dy)
{
    int n = d->n;
    memcpy(dy, y + n, (size_t)n * sizeof *dy);
    accelerations(d, dy + n, d->s->rheonomic ? d->lambda : NULL);
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
        if (factor(d) != KMP_GO)
            return KMP_RETRY;
        if (last)
            return KMP_GO;
        if (d->kept < d->r)
            return KMP_RETRY;
        correction(d, d->plant->h, d->dx);
        double size = size_of(d, d->dx);
        last = size <= LAST_CORRECTION * d->last || kmp_plant_residual(d->plant) <= KMP_CLOSED;
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
    d->eps = NOTHING;
    if (!dy)
        kmp_plant_closure(d->plant, t, y);
    else if (close_positions(d, t, y, as_it_is) != KMP_GO)
        return KMP_RETRY;
    if (dy && !as_it_is) {
        kmp_plant_rates(d->plant, y + n, d->y);
        correction(d, d->y, d->x);
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
    correction(d, d->plant->h, d->dx);
    kmp_plant_rates(d->plant, y + n, d->y);
    correction(d, d->y, d->x);
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
    kmp_closing closing = {d, d->plant, n, d->y, d->dx, place, correction};
    (void)yp;
    memcpy(q, y, (size_t)n * sizeof *q);
    qd = qd ? qd : d->x;
    memcpy(qd, y + n, (size_t)n * sizeof *qd);
    if (kmp_closing_run(&closing, t, q, qd) != KMP_GO)
        return KMP_HALT;
    if (qdd) {
        kmp_plant_bias(d->plant, qd);
        accelerations(d, qdd, lambda);
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
    void *arrays[] = {road->y, road->atol, d->l,  d->a,         d->full,      d->rr,    d->lambda, d->x,
                      d->y,    d->z,       d->dx, d->entry_row, d->entry_col, d->entry, d->none};
    kmp_saddle_free(&d->saddle);
    kmp_order_free(d->order);
    for (size_t k = 0; k < sizeof arrays / sizeof *arrays; k++)
        kmp_free(arrays[k]);
    kmp_free(d->pivot);
    kmp_text_free(&road->reason);
    kmp_free(d);
}

static bool allocate_large(zone *d)
{
    size_t nz = (size_t)d->s->jacobian.count;
    d->entry_row = KMP_NEW(int, nz);
    d->entry_col = KMP_NEW(int, nz);
    d->entry = KMP_NEW(double, nz);
    d->order = kmp_order_new(d->r, d->n);
    return d->entry_row && d->entry_col && d->entry && d->order &&
           kmp_saddle_init_with_out(&d->saddle, d->plant, d->part);
}

static bool allocate_small(zone *d)
{
    size_t n = (size_t)d->n, r = (size_t)d->r;
    d->l = KMP_NEW(double, n *n);
    d->a = KMP_NEW(double, n *r);
    d->full = KMP_NEW(double, n *r);
    d->rr = KMP_NEW(double, r *r);
    d->z = KMP_NEW(double, r);
    d->pivot = KMP_NEW(int, r);
    return d->l && d->a && d->full && d->rr && d->z && d->pivot;
}

static bool allocate(zone *d)
{
    d->road.y = KMP_NEW(double, d->road.size);
    d->road.atol = KMP_NEW(double, d->road.size);
    d->x = KMP_NEW(double, d->n);
    d->y = KMP_NEW(double, d->m);
    d->dx = KMP_NEW(double, d->n);
    d->lambda = KMP_NEW(double, d->m);
    d->none = KMP_NEW(double, d->m);
    return d->road.y && d->road.atol && d->x && d->y && d->dx && d->lambda && d->none &&
           (d->large ? allocate_large(d) : allocate_small(d));
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
    d->part = start->part;
    d->margin = start->margin;
    d->eps_march = EPS;
    d->n = n;
    d->m = start->part->m;
    d->r = start->part->r;
    d->large = kmp_pick_is_large(d->m, d->n, d->s->jacobian.count);
    d->has_work = start->system->dissipative;
    d->road.release = release;
    d->road.row = row;
    d->road.position = position;
    d->road.resume = resume;
    d->road.size = 2 * n + d->has_work;
    d->road.rtol = fmax(start->rtol, ZONE_RTOL);
    d->road.ode = (kmp_ode){
        .n = d->road.size, .self = d, .rhs = rhs, .accept = accept, .closed = closed, .turns = turns, .positions = n};
    if (!allocate(d)) {
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
