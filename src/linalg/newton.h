/* SPDX-License-Identifier: BSD-3-Clause */
/* Newton's method on a small system, from a guess: steps are halved while they leave the domain or diverge. If the
 * guess of one unknown is the best of several, the iteration descends in the merit, between the candidates on either
 * side. A step that leaves this interval, or gains too little, becomes a bisection (Dekker's safeguard). Of several
 * basins each that may contain the lowest merit is searched.
 *
 * For the library and for generated code: C99, no library but libm. */
#ifndef KMP_NEWTON_H
#define KMP_NEWTON_H

#include "linalg/dense/factors.h"

enum { KMP_NEWTON_MOST = 6, KMP_NEWTON_STEPS = 60, KMP_NEWTON_HALVINGS = 12 };

typedef struct kmp_newton {
    int unknowns, candidates; /* candidates of unknown 0; 0: the guess is the only one */
    const double *candidate;  /* increasing */
    void *self;
    /* Residuals at y, then their derivatives row by row, then, with candidates of a single unknown, the derivative of
     * the merit. Sets the merit where there are candidates. */
    const double *(*equations)(void *self, const double *y, double *merit);
    void (*guess)(void *self, double *y); /* of all unknowns; with candidates of those after y[0] */
    const double *(*merits)(void *self);  /* at the candidates */
    double y[KMP_NEWTON_MOST], merit;
} kmp_newton;

static inline double kmp_newton_largest(int n, const double *x)
{
    double size = 0;
    for (int i = 0; i < n; i++)
        size = fabs(x[i]) <= size || isnan(size) ? size : fabs(x[i]); /* NaN stays */
    return size;
}

/* Two unknowns: Gauss with the larger pivot. */
static inline void kmp_newton_direction_of_two(const double *f, double *dy)
{
    const double *a = f + 2;
    int p = fabs(a[0]) >= fabs(a[2]) ? 0 : 1, r = 1 - p; /* rows: of the pivot, the other */
    double factor = a[2 * r] / a[2 * p];
    dy[1] = -(f[r] - factor * f[p]) / (a[2 * r + 1] - factor * a[2 * p + 1]);
    dy[0] = -(f[p] + a[2 * p + 1] * dy[1]) / a[2 * p];
}

/* dy = -A^-1 F. false: singular. */
static inline bool kmp_newton_direction(int n, const double *f, double *dy)
{
    double a[KMP_NEWTON_MOST * KMP_NEWTON_MOST];
    int pivot[KMP_NEWTON_MOST];
    if (n == 1) {
        dy[0] = -f[0] / f[1];
    } else if (n == 2) {
        kmp_newton_direction_of_two(f, dy);
    } else {
        for (int i = 0; i < n; i++) {
            dy[i] = -f[i];
            for (int j = 0; j < n; j++)
                a[i + j * n] = f[n + i * n + j];
        }
        if (kmp_lu_factor(n, a, pivot))
            return false;
        kmp_lu_solve(n, a, pivot, 1, dy);
    }
    return isfinite(kmp_newton_largest(n, dy));
}

/* Steps along dy; shorter where the residuals are NaN or grow. */
static inline const double *kmp_newton_advance(kmp_newton *s, double *dy, double residual)
{
    int n = s->unknowns;
    double from[KMP_NEWTON_MOST];
    const double *f = NULL;
    for (int i = 0; i < n; i++)
        from[i] = s->y[i];
    for (int k = 0; k <= KMP_NEWTON_HALVINGS; k++) {
        for (int i = 0; i < n; i++)
            s->y[i] = from[i] + dy[i];
        f = s->equations(s->self, s->y, &s->merit);
        if (kmp_newton_largest(n, f) <= 2 * residual)
            break;
        for (int i = 0; i < n && k < KMP_NEWTON_HALVINGS; i++)
            dy[i] *= 0.5;
    }
    return f;
}

/* True if a step is as small as rounding makes it; `before` is the step before it. */
static inline bool kmp_newton_is_last(double step, double before, double size)
{
    return step <= 2 * DBL_EPSILON * size || (step <= 1e-9 * size && step >= 0.5 * before);
}

/* True if Newton's step is the last one, judged by the step before it: the remaining error is rounding. */
static inline bool kmp_newton_is_final(double step, double before, double size)
{
    double rate = step / before;
    bool quadratic = isfinite(before) && step <= 1e-8 * size && step * rate * rate <= DBL_EPSILON / 4 * size;
    return quadratic || kmp_newton_is_last(step, before, size);
}

static inline void kmp_newton_grow(int n, const double *y, double *size)
{
    for (int i = 0; i < n; i++)
        size[i] = fabs(y[i]) <= size[i] || isnan(size[i]) ? size[i] : fabs(y[i]); /* NaN stays */
}

/* The greatest step of an unknown relative to its own size: unknowns may have different units. */
static inline double kmp_newton_part_of(int n, const double *dy, const double *size)
{
    double part = 0;
    for (int i = 0; i < n; i++)
        part = fmax(part, dy[i] != 0 ? fabs(dy[i]) / size[i] : 0);
    return part;
}

/* True if steps no longer decrease: the remaining step of an unknown near zero is rounding of the others. */
static inline bool kmp_newton_stands(int n, const double *dy, const double *size, double part, double before)
{
    return isfinite(before) && part >= 0.9 * before && kmp_newton_largest(n, dy) <= 1e-9 * kmp_newton_largest(n, size);
}

/* True if no part of the step is as large as a rounding of its unknown. */
static inline bool kmp_newton_is_lost(int n, const double *y, const double *dy)
{
    bool lost = true;
    for (int i = 0; i < n; i++)
        lost = lost && y[i] + dy[i] == y[i];
    return lost;
}

/* Newton's iteration from y on. */
static inline bool kmp_newton_descend(kmp_newton *s)
{
    int n = s->unknowns;
    double dy[KMP_NEWTON_MOST] = {0}, size[KMP_NEWTON_MOST] = {0}, before = INFINITY;
    const double *f = s->equations(s->self, s->y, &s->merit);
    kmp_newton_grow(n, s->y, size);
    for (int k = 0; k < KMP_NEWTON_STEPS; k++) {
        double residual = kmp_newton_largest(n, f);
        if (!kmp_newton_direction(n, f, dy))
            return false;
        double step = kmp_newton_largest(n, dy), part = kmp_newton_part_of(n, dy, size);
        if (kmp_newton_is_final(part, before, 1) || kmp_newton_stands(n, dy, size, part, before)) {
            for (int i = 0; i < n; i++)
                s->y[i] += dy[i];
            return true;
        }
        f = kmp_newton_advance(s, dy, residual);
        bool whole = kmp_newton_largest(n, dy) == step;
        if (!whole && part <= 1e-9 && kmp_newton_is_lost(n, s->y, dy)) /* residuals are roundings, of any size */
            return true;
        kmp_newton_grow(n, s->y, size);
        if (!isfinite(kmp_newton_largest(n, size)))
            return false;
        before = whole ? part : INFINITY;
    }
    return false;
}

/* Starting values of a candidate. */
static inline void kmp_newton_begin_at(kmp_newton *s, double first)
{
    for (int i = 0; i < KMP_NEWTON_MOST; i++)
        s->y[i] = 0;
    s->y[0] = first;
    s->guess(s->self, s->y);
}

/* The candidate with the least merit; -1: none has one. */
static inline int kmp_newton_best_candidate(const kmp_newton *block, const double *merit)
{
    int best = -1;
    double least = INFINITY;
    for (int k = 0; k < block->candidates; k++)
        if (merit[k] < least && merit[k] > -INFINITY) {
            least = merit[k];
            best = k;
        }
    return best;
}

/* The current value of one unknown, and the ends of the interval in which the least merit is searched. `spacing` is the
 * distance of the candidates there; for a single candidate, Newton's first step. */
typedef struct kmp_newton_valley {
    double y, low, high, spacing;
    double residual, slope, merit_slope, merit;
} kmp_newton_valley;

/* false: there are no values. */
static inline bool kmp_newton_look(kmp_newton *s, double y, kmp_newton_valley *v)
{
    s->y[0] = y;
    const double *f = s->equations(s->self, s->y, &s->merit);
    v->y = y;
    v->residual = f[0];
    v->slope = f[1];
    v->merit_slope = f[2];
    v->merit = s->merit;
    return isfinite(f[0]) && isfinite(f[1]) && isfinite(f[2]) && isfinite(s->merit);
}

static inline kmp_newton_valley kmp_newton_valley_of(const kmp_newton *b, int best)
{
    const double *c = b->candidate;
    bool first = best == 0, last = best == b->candidates - 1;
    kmp_newton_valley v = {.low = first ? -INFINITY : c[best - 1], .high = last ? INFINITY : c[best + 1]};
    v.spacing = first && last ? INFINITY : first ? v.high - c[best] : last ? c[best] - v.low : (v.high - v.low) / 2;
    return v;
}

/* Downhill, to the middle; where there is no end, by a spacing. */
static inline double kmp_newton_middle(const kmp_newton_valley *v)
{
    double end = v->merit_slope > 0 ? v->low : v->high;
    return v->y + copysign(isfinite(end) ? fabs(end - v->y) / 2 : v->spacing, -v->merit_slope);
}

/* Moves to y. If y is outside the domain or behind a local maximum, it becomes an end. Maxima narrower than a
 * thousandth of the spacing count as rounding. */
static inline void kmp_newton_go(kmp_newton *s, kmp_newton_valley *v, double y)
{
    kmp_newton_valley next = *v;
    bool good = kmp_newton_look(s, y, &next);
    bool hill = next.merit > v->merit && fabs(y - v->y) > 1e-3 * v->spacing;
    if (good && !hill)
        *v = next;
    else if (y > v->y)
        v->high = y;
    else
        v->low = y;
}

/* The lowest point of the parabola through the merits of a candidate and its neighbours; the candidate itself where
 * there is none. */
static inline double kmp_newton_lowest(const kmp_newton *b, const double *merit, int best)
{
    const double *c = b->candidate + best, *m = merit + best;
    if (best == 0 || best == b->candidates - 1)
        return *c;
    double left = (m[0] - m[-1]) / (c[0] - c[-1]), right = (m[1] - m[0]) / (c[1] - c[0]);
    double curvature = (right - left) / (c[1] - c[-1]),
           y = c[0] - (left + curvature * (c[0] - c[-1])) / (2 * curvature);
    return y > c[-1] && y < c[1] ? y : *c;
}

/* Solves for one unknown, from near its best candidate. */
static inline bool kmp_newton_descend_among(kmp_newton *s, const double *merit, int best)
{
    kmp_newton_valley v = kmp_newton_valley_of(s, best);
    double before = INFINITY, there = s->candidate[best], begin = kmp_newton_lowest(s, merit, best);
    double least = merit[best];
    bool good = kmp_newton_look(s, begin, &v) && v.merit <= least;
    if (!good && (begin == there || !kmp_newton_look(s, there, &v)))
        return false;
    if (!isfinite(v.spacing))
        v.spacing = fabs(v.residual / v.slope);
    for (int k = 0; k < KMP_NEWTON_STEPS; k++) {
        double step = v.residual == 0 ? 0 : -v.residual / v.slope, y = v.y + step;
        double size = fmax(fabs(v.y), v.spacing);
        bool downhill = step * v.merit_slope <= 0;
        s->y[0] = y;
        s->merit = v.merit;
        if (!isfinite(size))
            return false;
        if (step == 0 || ((downhill || k > 0) && kmp_newton_is_final(fabs(step), before, size)))
            return true;
        if (v.merit_slope > 0)
            v.high = v.y;
        else
            v.low = v.y;
        if (!(y > v.low && y < v.high) || !downhill || fabs(step) > before / 2)
            y = kmp_newton_middle(&v);
        before = fabs(y - v.y);
        s->y[0] = v.y;
        if (before == 0)
            return true;
        kmp_newton_go(s, &v, y);
    }
    return false;
}

/* True if a candidate is lower than its neighbours. *bound: a lower bound of the merit there, from the lines through
 * the candidate and either neighbour, valid where the merit is convex. */
static inline bool kmp_newton_is_valley(const kmp_newton *b, const double *merit, int k, double *bound)
{
    const double *c = b->candidate + k, *m = merit + k;
    bool first = k == 0, last = k == b->candidates - 1;
    *bound = -INFINITY;
    if (!isfinite(*m) || (!first && m[-1] < *m) || (!last && m[1] <= *m))
        return false;
    if (!first && !last) {
        double before = (m[-1] - m[0]) / (c[0] - c[-1]), after = (m[1] - m[0]) / (c[1] - c[0]);
        *bound = m[0] - fmax(before * (c[1] - c[0]), after * (c[0] - c[-1]));
    }
    return true;
}

/* Descends from the best candidate, then from candidates that may have lower merit. */
static inline bool kmp_newton_solve_one_among(kmp_newton *s, const double *merit, int best)
{
    bool solved = kmp_newton_descend_among(s, merit, best);
    double y = s->y[0], least = solved ? s->merit : INFINITY, bound;
    for (int k = 0; k < s->candidates; k++)
        if (k != best && kmp_newton_is_valley(s, merit, k, &bound) && bound < least &&
            kmp_newton_descend_among(s, merit, k) && s->merit < least) {
            solved = true;
            least = s->merit;
            y = s->y[0];
        }
    s->y[0] = y;
    return solved;
}

static inline bool kmp_newton_solve_among(kmp_newton *s)
{
    const double *merit = s->merits(s->self);
    int best = kmp_newton_best_candidate(s, merit);
    if (best < 0)
        return false;
    if (s->unknowns == 1)
        return kmp_newton_solve_one_among(s, merit, best);
    kmp_newton_begin_at(s, s->candidate[best]);
    return kmp_newton_descend(s);
}

/** Sets y. False: there is no solution. */
static inline bool kmp_newton_solve(kmp_newton *s)
{
    if (s->candidates > 0)
        return kmp_newton_solve_among(s);
    s->guess(s->self, s->y);
    return kmp_newton_descend(s);
}

#endif
