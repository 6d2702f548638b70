/* SPDX-License-Identifier: BSD-3-Clause */
/* With u = (joints, deformations) independent and udd = 0, the rows X' (M qdd + C) = 0 of the deformations are solved
 * by Newton's method, whose matrix is that of differences: they are almost linear. Accelerations of dependent joints
 * and of drives are those of the closures. */
#include "constraints/closing/static_start.h"
#include "backend/machine.h"
#include "base/context.h"
#include "constraints/closing/close.h"
#include "constraints/evaluation/load_multipliers.h"
#include "constraints/partition/reduction.h"
#include "constraints/tolerances.h"
#include "linalg/dense/factors.h"
#include "model/data/model.h"
#include "model/data/start.h"
#include <math.h>
#include <string.h>

enum { MOST_STEPS = 60, MOST_HALVES = 12 };

typedef struct settling {
    const kempe_system *s;
    kmp_evaluator *eval;
    kmp_partition part;
    kmp_reduction red;
    kmp_arena arena;
    int count;            /* deformations that move */
    int *in_u, *pivots;   /* count: their places in u */
    double *q, *trial;    /* n */
    double *qd;           /* n */
    double *ud, *udd;     /* p; udd is zero */
    double *all;          /* p: rows of all independent coordinates */
    double *rest, *other; /* count: rows of the deformations */
    double *slope;        /* count x count, by columns */
    double *step;         /* count */
} settling;

static int coordinate(const settling *x, int k)
{
    return x->part.u[x->in_u[k]];
}

/* The rows of the deformations at q, whose dependent coordinates are closed. False: they do not close, or a number is
 * not finite. */
static bool take_rows(settling *x, double *q, double *rows)
{
    if (x->part.r > 0 && kmp_reduction_close(&x->red, 0, q, NULL, 0) != 0)
        return false;
    kmp_eval_closure(x->eval, 0, q);
    if (kmp_reduction_factor(&x->red) != 0)
        return false;
    kmp_reduction_tangent(&x->red);
    kmp_reduction_rates(&x->red, x->ud, x->qd);
    kmp_eval_mass(x->eval);
    kmp_load_forget(x->eval);
    kmp_eval_bias(x->eval, x->qd);
    kmp_reduction_residual(&x->red, x->udd, x->all);
    bool finite = true;
    for (int k = 0; k < x->count; k++) {
        rows[k] = x->all[x->in_u[k]];
        finite = finite && isfinite(rows[k]);
    }
    return finite;
}

/* Their derivatives by the deformations. */
static bool take_slope(settling *x)
{
    for (int k = 0; k < x->count; k++) {
        const double move = KMP_STATIC_DIFFERENCE * x->s->scale[coordinate(x, k)];
        memcpy(x->trial, x->q, (size_t)x->s->n * sizeof *x->q);
        x->trial[coordinate(x, k)] += move;
        if (!take_rows(x, x->trial, x->other))
            return false;
        for (int i = 0; i < x->count; i++)
            x->slope[i + x->count * k] = (x->other[i] - x->rest[i]) / move;
    }
    return true;
}

/* The length of the rows as works along one scale of each coordinate. */
static double size_of(const settling *x, const double *rows)
{
    double sum = 0;
    for (int k = 0; k < x->count; k++)
        sum = hypot(sum, rows[k] * x->s->scale[coordinate(x, k)]);
    return sum;
}

/* A step of Newton, halved while the rows would grow; its length in scales of the coordinates. Negative: there is
 * none. */
static double move_on(settling *x)
{
    double length = 0;
    if (!take_slope(x))
        return -1;
    for (int k = 0; k < x->count; k++)
        x->step[k] = -x->rest[k];
    if (kmp_lu_factor(x->count, x->slope, x->pivots) != 0)
        return -1;
    kmp_lu_solve(x->count, x->slope, x->pivots, 1, x->step);
    for (int k = 0; k < x->count; k++)
        length = fmax(length, fabs(x->step[k]) / x->s->scale[coordinate(x, k)]);
    const double before = size_of(x, x->rest);
    for (int half = 0; half < MOST_HALVES; half++, length /= 2) {
        memcpy(x->trial, x->q, (size_t)x->s->n * sizeof *x->q);
        for (int k = 0; k < x->count; k++)
            x->trial[coordinate(x, k)] += ldexp(x->step[k], -half);
        if (take_rows(x, x->trial, x->other) && (size_of(x, x->other) < before || length <= KMP_STATIC_ROUNDED)) {
            memcpy(x->q, x->trial, (size_t)x->s->n * sizeof *x->q);
            memcpy(x->rest, x->other, (size_t)x->count * sizeof *x->rest);
            return length;
        }
    }
    return -1;
}

/* The symmetric part of the stiffness at the end: not positive beyond the load at which a body buckles. */
static bool is_stable(settling *x)
{
    if (!take_slope(x))
        return false;
    for (int i = 0; i < x->count; i++)
        for (int k = 0; k < i; k++) {
            const double mean = (x->slope[i + x->count * k] + x->slope[k + x->count * i]) / 2;
            x->slope[i + x->count * k] = x->slope[k + x->count * i] = mean;
        }
    return kmp_cholesky_factor(x->count, x->slope) == 0;
}

static kempe_status settle(settling *x)
{
    double last = INFINITY, length = take_rows(x, x->q, x->rest) ? INFINITY : -1;
    for (int k = 0; k < MOST_STEPS && length > KMP_STATIC_STEP && !(length <= KMP_STATIC_ROUNDED && length >= last);
         k++) {
        last = length;
        length = move_on(x);
    }
    if (!(length >= 0 && length <= KMP_STATIC_ROUNDED))
        return kmp_fail(x->s->context, KEMPE_E_FAILED,
                        "start: the flexible bodies find no balance with the loads of the start near their given "
                        "deformations: the loads may be more than those at which one of them buckles; take 'elastic: "
                        "held', or other deformations (start: q)");
    if (!is_stable(x))
        kmp_log(x->s->context, KEMPE_LOG_WARNING,
                "start: the deformations are in balance with the loads of the start, but not in a stable one: a "
                "flexible body buckles under less than these");
    return KEMPE_OK;
}

/* Deformations are chosen as independent, and what holds or has a given start before the other joints. */
static kempe_status choose(settling *x, const kempe_assembly *a)
{
    const kempe_system *s = x->s;
    const kmp_start *start = &s->model->start;
    bool *liked = KMP_ARENA_NEW(&x->arena, bool, s->n);
    int *wish = KMP_ARENA_NEW(&x->arena, int, s->n), count = -1;
    x->eval = kmp_eval_new(s, kmp_backend_default());
    for (int k = 0; liked && k < s->n; k++)
        liked[k] = start->undeformed[k] || start->hold[k] || start->q_given[k];
    if (x->eval && liked && wish) {
        kmp_eval_closure(x->eval, 0, a->q);
        count = kmp_partition_prefer(s, x->eval->jacobian, liked, wish);
    }
    if (count < 0)
        return kmp_fail_memory(s->context);
    KMP_TRY(kmp_partition_init(&x->part, s, x->eval->jacobian, wish, count));
    KMP_TRY(kmp_reduction_init(&x->red, x->eval, &x->part));
    const int n = s->n, p = x->part.p;
    if (!KMP_ARENA_MAKE(&x->arena, KMP_ROOM(int, p, &x->in_u, &x->pivots),
                        KMP_ROOM(double, n, &x->q, &x->trial, &x->qd),
                        KMP_ROOM(double, p, &x->ud, &x->udd, &x->all, &x->rest, &x->other, &x->step),
                        KMP_ROOM(double, p *p, &x->slope)))
        return kmp_fail_memory(s->context);
    for (int k = 0; k < p; k++) {
        x->ud[k] = a->qd[x->part.u[k]];
        if (start->undeformed[x->part.u[k]])
            x->in_u[x->count++] = k;
    }
    memcpy(x->q, a->q, (size_t)n * sizeof *x->q);
    return KEMPE_OK;
}

kempe_status kmp_static_start(const kempe_system *s, kempe_assembly *a)
{
    settling x = {.s = s};
    if (!s->model->start.statics || !a->closed)
        return KEMPE_OK;
    if (a->inner_q)
        return kmp_fail(s->context, KEMPE_E_FAILED,
                        "start: 'elastic: static' is not possible where a spherical joint is near its singular "
                        "position; give it other axes");
    kempe_status status = choose(&x, a);
    if (status == KEMPE_OK && x.count > 0)
        status = settle(&x);
    for (int k = 0; status == KEMPE_OK && k < s->n; k++) {
        a->moved[k] += x.q[k] - a->q[k];
        a->q[k] = x.q[k];
    }
    if (status == KEMPE_OK && x.count > 0) {
        (void)take_rows(&x, x.q, x.rest);
        memcpy(a->qd, x.qd, (size_t)s->n * sizeof *a->qd);
    }
    kmp_reduction_free(&x.red);
    kmp_partition_free(&x.part);
    kmp_eval_free(x.eval);
    kmp_arena_free(&x.arena);
    return status;
}
