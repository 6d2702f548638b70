/* SPDX-License-Identifier: BSD-3-Clause */
/* Newton's method on a block, from its guess: steps are halved while they leave the domain or diverge. If the guess of
 * one unknown is the best of several, the iteration descends in the merit, between the candidates on either side. A
 * step that leaves this interval, or gains too little, becomes a bisection (Dekker's safeguard). Of several basins each
 * that may contain the lowest merit is searched. */
#include "base/memory.h"
#include "linalg/dense/dense.h"
#include "symbolic/implicit.h"
#include "symbolic/program/interpreter.h"
#include "symbolic/sums/average.h"
#include "symbolic/sums/scan.h"
#include <float.h>
#include <math.h>
#include <string.h>

/* KEPT: solutions, of the lists of arguments that are evaluated in turn: those of the lanes of a vector register. */
enum { MOST = KMP_IMPLICIT_MOST, MOST_STEPS = 60, MOST_HALVINGS = 12, KEPT = 8 };

struct kmp_solving {
    const kmp_program_block *block;
    const kmp_block_runner *runner;
    bool shares;    /* the next three belong to another one */
    void *code;     /* the runner's */
    kmp_scan *scan; /* of candidates, if there are some */
    kmp_average *average;
    double *p;                  /* the current arguments */
    double *solved, *component; /* KEPT: arguments, and their solutions */
    int known, next;            /* of these: their number, the one that the next solution replaces */
    double y[MOST], merit;
};

/* The interpreter as a runner. */
static void *prepare(const kmp_program *program)
{
    return kmp_interpreter_new(program);
}

static void release(void *code)
{
    kmp_interpreter_free(code);
}

static void set(void *code, kmp_input_kind kind, const double *values)
{
    kmp_interpreter_set(code, kind, values);
}

static void run(void *code, int stage)
{
    kmp_interpreter_run(code, stage);
}

static const double *outputs(const void *code, int stage)
{
    return kmp_interpreter_outputs(code, stage);
}

static const kmp_block_runner interpreted = {prepare, release, set, run, outputs};

static const double *run_stage(kmp_solving *s, int stage)
{
    s->runner->run(s->code, stage);
    return s->runner->outputs(s->code, stage);
}

static void set_unknowns(kmp_solving *s)
{
    s->runner->set(s->code, KMP_IN_Q, s->y);
}

static bool prepare_block(kmp_solving *s)
{
    if (s->block->averages) {
        s->average = kmp_average_room(s->block);
        return s->average;
    }
    s->code = s->runner->prepare(s->block->program);
    if (s->block->candidates > 0)
        s->scan = kmp_scan_new(s->block, s->block->candidates, s->block->candidate);
    return s->code && (s->block->candidates == 0 || s->scan);
}

/* Without a program's code or room. */
static kmp_solving *begin(const kmp_program_block *block, const kmp_block_runner *runner)
{
    kmp_solving *s = KMP_NEW(kmp_solving, 1);
    if (!s)
        return NULL;
    s->block = block;
    s->runner = runner ? runner : &interpreted;
    s->p = KMP_NEW(double, (1 + KEPT) * block->arguments + KEPT * block->unknowns);
    if (!s->p) {
        kmp_free(s);
        return NULL;
    }
    s->solved = s->p + block->arguments;
    s->component = s->solved + KEPT * block->arguments;
    return s;
}

kmp_solving *kmp_solving_new(const kmp_program_block *block, const kmp_block_runner *runner)
{
    kmp_solving *s = begin(block, runner);
    if (s && !prepare_block(s)) {
        kmp_solving_free(s);
        return NULL;
    }
    return s;
}

kmp_solving *kmp_solving_beside(const kmp_solving *other)
{
    kmp_solving *s = begin(other->block, other->runner);
    if (!s)
        return NULL;
    s->shares = true;
    s->code = other->code;
    s->scan = other->scan;
    s->average = other->average;
    return s;
}

void kmp_solving_free(kmp_solving *s)
{
    if (!s)
        return;
    if (!s->shares) {
        if (s->code)
            s->runner->release(s->code);
        kmp_scan_free(s->scan);
        kmp_average_room_free(s->average);
    }
    kmp_free(s->p);
    kmp_free(s);
}

double *kmp_solving_arguments(kmp_solving *s)
{
    return s->p;
}

static double largest(int n, const double *x)
{
    double size = 0;
    for (int i = 0; i < n; i++)
        size = fabs(x[i]) <= size ? size : fabs(x[i]); /* NaN stays */
    return size;
}

/* Residuals and derivatives at y. Parts that the guesses and the merit share with them were computed elsewhere. */
static const double *equations(kmp_solving *s)
{
    set_unknowns(s);
    if (s->block->candidates > 0) {
        if (s->block->unknowns > 1)
            (void)run_stage(s, 1);
        s->merit = *run_stage(s, 2);
    }
    return run_stage(s, s->block->program->stages - 1);
}

/* Two unknowns: Gauss with the larger pivot. */
static void direction_of_two(const double *f, double *dy)
{
    const double *a = f + 2;
    int p = fabs(a[0]) >= fabs(a[2]) ? 0 : 1, r = 1 - p; /* rows: of the pivot, the other */
    double factor = a[2 * r] / a[2 * p];
    dy[1] = -(f[r] - factor * f[p]) / (a[2 * r + 1] - factor * a[2 * p + 1]);
    dy[0] = -(f[p] + a[2 * p + 1] * dy[1]) / a[2 * p];
}

/* dy = -A^-1 F. false: singular. */
static bool direction(int n, const double *f, double *dy)
{
    double a[MOST * MOST];
    int pivot[MOST];
    if (n == 1) {
        dy[0] = -f[0] / f[1];
    } else if (n == 2) {
        direction_of_two(f, dy);
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
    return isfinite(largest(n, dy));
}

/* Steps along dy; shorter where the residuals are NaN or grow. */
static const double *advance(kmp_solving *s, double *dy, double residual)
{
    int n = s->block->unknowns;
    double from[MOST];
    const double *f = NULL;
    memcpy(from, s->y, sizeof from);
    for (int k = 0; k <= MOST_HALVINGS; k++) {
        for (int i = 0; i < n; i++)
            s->y[i] = from[i] + dy[i];
        f = equations(s);
        if (largest(n, f) <= 2 * residual)
            break;
        for (int i = 0; i < n && k < MOST_HALVINGS; i++)
            dy[i] *= 0.5;
    }
    return f;
}

/* True if a step is as small as rounding makes it; `before` is the step before it. */
static bool is_last(double step, double before, double size)
{
    return step <= 2 * DBL_EPSILON * size || (step <= 1e-9 * size && step >= 0.5 * before);
}

/* True if Newton's step is the last one, judged by the step before it: the remaining error is rounding. */
static bool is_final(double step, double before, double size)
{
    double rate = step / before;
    bool quadratic = isfinite(before) && step <= 1e-8 * size && step * rate * rate <= DBL_EPSILON / 4 * size;
    return quadratic || is_last(step, before, size);
}

static void grow(int n, const double *y, double *size)
{
    for (int i = 0; i < n; i++)
        size[i] = fabs(y[i]) <= size[i] ? size[i] : fabs(y[i]); /* NaN stays */
}

/* The greatest step of an unknown relative to its own size: unknowns may have different units. */
static double part_of(int n, const double *dy, const double *size)
{
    double part = 0;
    for (int i = 0; i < n; i++)
        part = fmax(part, dy[i] != 0 ? fabs(dy[i]) / size[i] : 0);
    return part;
}

/* True if steps no longer decrease: the remaining step of an unknown near zero is rounding of the others. */
static bool stands(int n, const double *dy, const double *size, double part, double before)
{
    return isfinite(before) && part >= 0.9 * before && largest(n, dy) <= 1e-9 * largest(n, size);
}

/* Newton's iteration from y on. */
static bool descend(kmp_solving *s)
{
    int n = s->block->unknowns;
    double dy[MOST] = {0}, size[MOST] = {0}, before = INFINITY;
    const double *f = equations(s);
    grow(n, s->y, size);
    for (int k = 0; k < MOST_STEPS; k++) {
        double residual = largest(n, f);
        if (!direction(n, f, dy))
            return false;
        double step = largest(n, dy), part = part_of(n, dy, size);
        if (is_final(part, before, 1) || stands(n, dy, size, part, before)) {
            for (int i = 0; i < n; i++)
                s->y[i] += dy[i];
            return true;
        }
        f = advance(s, dy, residual);
        bool whole = largest(n, dy) == step;
        grow(n, s->y, size);
        if (!isfinite(largest(n, size)))
            return false;
        before = whole ? part : INFINITY;
    }
    return false;
}

/* Starting values of a candidate. */
static void begin_at(kmp_solving *s, double candidate)
{
    int n = s->block->unknowns;
    memset(s->y, 0, sizeof s->y);
    s->y[0] = candidate;
    set_unknowns(s);
    memcpy(s->y + 1, run_stage(s, 1) + 1, (size_t)(n - 1) * sizeof(double));
}

/* The candidate with the least merit; -1: none has one. */
static int best_candidate(const kmp_program_block *block, const double *merit)
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
typedef struct valley {
    double y, low, high, spacing;
    double residual, slope, merit_slope, merit;
} valley;

/* false: there are no values. */
static bool look(kmp_solving *s, double y, valley *v)
{
    s->y[0] = y;
    const double *f = equations(s);
    v->y = y;
    v->residual = f[0];
    v->slope = f[1];
    v->merit_slope = f[2];
    v->merit = s->merit;
    return isfinite(f[0]) && isfinite(f[1]) && isfinite(f[2]) && isfinite(s->merit);
}

static valley valley_of(const kmp_program_block *b, int best)
{
    const double *c = b->candidate;
    bool first = best == 0, last = best == b->candidates - 1;
    valley v = {.low = first ? -INFINITY : c[best - 1], .high = last ? INFINITY : c[best + 1]};
    v.spacing = first && last ? INFINITY : first ? v.high - c[best] : last ? c[best] - v.low : (v.high - v.low) / 2;
    return v;
}

/* Downhill, to the middle; where there is no end, by a spacing. */
static double middle(const valley *v)
{
    double end = v->merit_slope > 0 ? v->low : v->high;
    return v->y + copysign(isfinite(end) ? fabs(end - v->y) / 2 : v->spacing, -v->merit_slope);
}

/* Moves to y. If y is outside the domain or behind a local maximum, it becomes an end. Maxima narrower than a
 * thousandth of the spacing count as rounding. */
static void go(kmp_solving *s, valley *v, double y)
{
    valley next = *v;
    bool good = look(s, y, &next);
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
static double lowest(const kmp_program_block *b, const double *merit, int best)
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
static bool descend_among(kmp_solving *s, const double *merit, int best)
{
    valley v = valley_of(s->block, best);
    double before = INFINITY, candidate = s->block->candidate[best], begin = lowest(s->block, merit, best);
    double least = merit[best];
    bool good = look(s, begin, &v) && v.merit <= least;
    if (!good && (begin == candidate || !look(s, candidate, &v)))
        return false;
    if (!isfinite(v.spacing))
        v.spacing = fabs(v.residual / v.slope);
    for (int k = 0; k < MOST_STEPS; k++) {
        double step = v.residual == 0 ? 0 : -v.residual / v.slope, y = v.y + step;
        double size = fmax(fabs(v.y), v.spacing);
        bool downhill = step * v.merit_slope <= 0;
        s->y[0] = y;
        s->merit = v.merit;
        if (!isfinite(size))
            return false;
        if (step == 0 || ((downhill || k > 0) && is_final(fabs(step), before, size)))
            return true;
        if (v.merit_slope > 0)
            v.high = v.y;
        else
            v.low = v.y;
        if (!(y > v.low && y < v.high) || !downhill || fabs(step) > before / 2)
            y = middle(&v);
        before = fabs(y - v.y);
        s->y[0] = v.y;
        if (before == 0)
            return true;
        go(s, &v, y);
    }
    return false;
}

/* True if a candidate is lower than its neighbours. *bound: a lower bound of the merit there, from the lines through
 * the candidate and either neighbour, valid where the merit is convex. */
static bool is_valley(const kmp_program_block *b, const double *merit, int k, double *bound)
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

/* Descends from the best candidate, then from those that may have lower merit. */
static bool solve_one_among(kmp_solving *s, const double *merit, int best)
{
    bool solved = descend_among(s, merit, best);
    double y = s->y[0], least = solved ? s->merit : INFINITY, bound;
    for (int k = 0; k < s->block->candidates; k++)
        if (k != best && is_valley(s->block, merit, k, &bound) && bound < least && descend_among(s, merit, k) &&
            s->merit < least) {
            solved = true;
            least = s->merit;
            y = s->y[0];
        }
    s->y[0] = y;
    return solved;
}

static bool solve_among(kmp_solving *s)
{
    const double *merit = kmp_scan_run(s->scan, s->p);
    int best = best_candidate(s->block, merit);
    if (best < 0)
        return false;
    if (s->block->unknowns == 1)
        return solve_one_among(s, merit, best);
    begin_at(s, s->block->candidate[best]);
    return descend(s);
}

static bool solve(kmp_solving *s)
{
    s->runner->set(s->code, KMP_IN_PARAMETER, s->p);
    (void)run_stage(s, 0);
    if (s->block->candidates > 0)
        return solve_among(s);
    memcpy(s->y, run_stage(s, 1), (size_t)s->block->unknowns * sizeof(double));
    return descend(s);
}

/* Solves for the current arguments; NaN where there is no solution. */
static void solve_anew(kmp_solving *s, double *component)
{
    int n = s->block->unknowns;
    if (s->average)
        kmp_average_run(s->average, s->p);
    else if (!solve(s))
        for (int i = 0; i < n; i++)
            s->y[i] = NAN;
    memcpy(component, s->average ? kmp_average_values(s->average) : s->y, (size_t)n * sizeof(double));
}

double kmp_solving_value(kmp_solving *s, int component)
{
    size_t arguments = (size_t)s->block->arguments, unknowns = (size_t)s->block->unknowns,
           bytes = arguments * sizeof(double);
    size_t k = 0, known = (size_t)s->known;
    while (k < known && memcmp(s->p, s->solved + k * arguments, bytes) != 0)
        k++;
    if (k == known) {
        k = (size_t)s->next;
        solve_anew(s, s->component + k * unknowns);
        memcpy(s->solved + k * arguments, s->p, bytes);
        s->known = s->known < KEPT ? s->known + 1 : KEPT;
        s->next = (s->next + 1) % KEPT;
    }
    return s->component[k * unknowns + (size_t)component];
}
