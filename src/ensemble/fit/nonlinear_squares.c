/* SPDX-License-Identifier: BSD-3-Clause */
#include "ensemble/fit/nonlinear_squares.h"
#include "base/arena.h"
#include "linalg/dense/dot.h"
#include <float.h>
#include <math.h>
#include <stddef.h>
#include <string.h>

#ifdef KEMPE_CMINPACK
#include <cminpack.h>

/* Starts are that far from a bound, relative to the range, or to the distance that counts as one. */
#define INSIDE 0.01
/* lmder shortens a step to a tenth where |r| grows tenfold. */
#define BEYOND 16.0
/* The first trust region, in norms of the scaled start. */
#define FIRST_REGION 10.0

typedef struct search {
    const kmp_squares *squares;
    kmp_squares_report report;
    bool ended, begun;
    double *x, *slope;                         /* bounded variables at free ones, and their derivatives */
    double *range;                             /* of each variable */
    double *residual, *jacobian, *jacobian_at; /* of the last evaluation, and its x */
    double best;                               /* norm of the residuals there */
    double *best_x;
} search;

/* -- bounds ------------------------------------------------------------------------------------------ */

static double take_in(double value, double low, double high)
{
    return fmin(fmax(value, low), high);
}

/* The free variable of a bounded one. */
static double free_of(const search *s, int k, double x)
{
    double low = s->squares->lower[k], high = s->squares->upper[k], range = s->range[k];
    if (isfinite(low) && isfinite(high))
        return asin(take_in(2 * (x - low) / range - 1, 2 * INSIDE - 1, 1 - 2 * INSIDE));
    if (!isfinite(low) && !isfinite(high))
        return x;
    double above = 1 + fmax(isfinite(low) ? x - low : high - x, INSIDE * range) / range;
    return range * sqrt(above * above - 1);
}

/* -- evaluations ------------------------------------------------------------------------------------- */

/* Residuals and derivatives at s->x, unless they are known. */
static kmp_lm_message evaluate(search *s)
{
    const kmp_squares *q = s->squares;
    size_t x_bytes = (size_t)q->count * sizeof *s->x;
    if (s->begun && memcmp(s->x, s->jacobian_at, x_bytes) == 0)
        return KMP_SQUARES_GO;
    s->begun = false;
    s->report.evaluations++;
    kmp_lm_message said = q->at(q->user, s->x, s->residual, s->jacobian);
    if (said == KMP_SQUARES_GO &&
        !(kmp_all_finite(q->rows, s->residual) && kmp_all_finite(q->rows * q->count, s->jacobian)))
        said = KMP_SQUARES_NOWHERE;
    if (said != KMP_SQUARES_GO)
        return said;
    s->begun = true;
    memcpy(s->jacobian_at, s->x, x_bytes);
    int count = q->rows;
    double sum = 0;
    for (int k = 0; k < count; k++)
        sum += s->residual[k] * s->residual[k];
    double size = sqrt(sum);
    if (!(s->best <= size)) {
        s->best = size;
        memcpy(s->best_x, s->x, x_bytes);
    }
    return said;
}

static int give_residuals(search *s, double *residual)
{
    const kmp_squares *q = s->squares;
    kmp_lm_message said = evaluate(s);
    s->ended = s->ended || said == KMP_SQUARES_END || (said == KMP_SQUARES_NOWHERE && !isfinite(s->best));
    if (s->ended)
        return -1;
    if (said == KMP_SQUARES_GO) {
        memcpy(residual, s->residual, (size_t)q->rows * sizeof *residual);
        return 0;
    }
    s->report.refused++;
    for (int i = 0; i < q->rows; i++)
        residual[i] = BEYOND * fmax(s->best, DBL_MIN) / sqrt(q->rows);
    return 0;
}

static int give_slopes(search *s, double *jacobian, int stride)
{
    const kmp_squares *q = s->squares;
    if (evaluate(s) != KMP_SQUARES_GO) {
        s->ended = true;
        return -1;
    }
    s->report.iterations++;
    for (int k = 0; k < q->count; k++) {
        const double *from = s->jacobian + (ptrdiff_t)k * q->rows;
        double *to = jacobian + (ptrdiff_t)k * stride;
        for (int i = 0; i < q->rows; i++)
            to[i] = from[i] * s->slope[k];
    }
    return 0;
}

static int answer(void *user, int rows, int count, const double *y, double *residual, double *jacobian, int stride,
                  int what)
{
    search *s = user;
    (void)rows, (void)count;
    if (what == 0)
        return 0;
    /* The bounded variables, and their slopes. */
    for (int k = 0; k < s->squares->count; k++) {
        double low = s->squares->lower[k], high = s->squares->upper[k], range = s->range[k];
        double root = sqrt(1 + y[k] / range * (y[k] / range));
        if (isfinite(low) && isfinite(high)) {
            s->x[k] = take_in(low + 0.5 * range * (1 + sin(y[k])), low, high);
            s->slope[k] = 0.5 * range * cos(y[k]);
        } else if (isfinite(low) || isfinite(high)) {
            double way = isfinite(low) ? 1 : -1;
            s->x[k] = (way > 0 ? low : high) + way * range * (root - 1);
            s->slope[k] = way * y[k] / range / root;
        } else {
            s->x[k] = y[k];
            s->slope[k] = 1;
        }
    }
    return what == 1 ? give_residuals(s, residual) : give_slopes(s, jacobian, stride);
}

/* -- the search -------------------------------------------------------------------------------------- */

const bool kmp_squares_available = true;

bool kmp_squares_minimise(const kmp_squares *squares, double *x, kmp_squares_report *report)
{
    enum { MOST = 5 }; /* what lmder reports of too many evaluations */
    int rows = squares->rows, count = squares->count, evaluations = 0, slopes = 0, *pivot;
    double *y, *diag, *qtf, *wa1, *wa2, *wa3, *wa4, *residual, *jacobian;
    search s = {.squares = squares, .best = INFINITY};
    kmp_arena arena = {0};
    ptrdiff_t table = (ptrdiff_t)rows * count;
    bool ok = KMP_ARENA_MAKE(&arena, KMP_ROOM(double, count, &y, &diag, &qtf, &wa1, &wa2, &wa3),
                             KMP_ROOM(double, count, &s.x, &s.slope, &s.range, &s.jacobian_at, &s.best_x),
                             KMP_ROOM(double, rows, &wa4, &residual, &s.residual),
                             KMP_ROOM(double, table, &jacobian, &s.jacobian), KMP_ROOM(int, count, &pivot));
    int info = 0;
    if (ok) {
        /* A variable with one bound turns into a line beyond this distance from it. */
        for (int k = 0; k < s.squares->count; k++) {
            double low = s.squares->lower[k], high = s.squares->upper[k];
            double away = isfinite(low) ? x[k] - low : high - x[k];
            if (isfinite(low) && isfinite(high))
                s.range[k] = high - low;
            else
                s.range[k] = away > 0 && isfinite(away) ? away : fmax(fabs(x[k]), 1);
        }
        for (int k = 0; k < count; k++)
            y[k] = free_of(&s, k, x[k]);
        info = lmder(answer, &s, rows, count, y, residual, jacobian, rows, squares->tolerance, squares->tolerance, 0,
                     squares->most, diag, 1, FIRST_REGION, 0, &evaluations, &slopes, pivot, qtf, wa1, wa2, wa3, wa4);
        bool started = isfinite(s.best);
        s.report.iterations -= s.report.iterations > 0; /* the first slopes belong to the start */
        s.report.outcome = !started       ? KMP_SQUARES_NO_START
                           : s.ended      ? KMP_SQUARES_ENDED
                           : info == MOST ? KMP_SQUARES_MOST
                                          : KMP_SQUARES_FOUND;
        if (started)
            memcpy(x, s.best_x, (size_t)count * sizeof *x);
        *report = s.report;
    }
    kmp_arena_free(&arena);
    return ok;
}

#else

const bool kmp_squares_available = false;

bool kmp_squares_minimise(const kmp_squares *squares, double *x, kmp_squares_report *report)
{
    (void)squares, (void)x, (void)report;
    return false;
}

#endif
