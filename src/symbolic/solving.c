/* SPDX-License-Identifier: BSD-3-Clause */
/* Newton's method on a block, from its guess: steps are halved while they lead out of the domain or away. Where the
 * guess of one unknown is the best of several, the way goes downhill in the merit, between the candidates on either
 * side: a step that leaves them, or gains too little, goes to the middle (Dekker's safeguard). */
#include "base/memory.h"
#include "linalg/dense.h"
#include "symbolic/implicit.h"
#include "symbolic/interpreter.h"
#include <float.h>
#include <math.h>
#include <string.h>

enum { MOST = KMP_IMPLICIT_MOST, MOST_STEPS = 60, MOST_HALVINGS = 12 };

struct kmp_solving {
    const kmp_block *block;
    kmp_interpreter *run;
    double *p, *solved; /* arguments: at hand, and those of y */
    double y[MOST], merit;
    bool known;
};

kmp_solving *kmp_solving_new(const kmp_block *block)
{
    kmp_solving *s = KMP_NEW(kmp_solving, 1);
    if (!s)
        return NULL;
    s->block = block;
    s->run = kmp_interpreter_new(block->program);
    s->p = KMP_NEW(double, 2 * block->arguments);
    if (!s->run || !s->p) {
        kmp_solving_free(s);
        return NULL;
    }
    s->solved = s->p + block->arguments;
    return s;
}

void kmp_solving_free(kmp_solving *s)
{
    if (!s)
        return;
    kmp_interpreter_free(s->run);
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

/* Residuals and slopes at y. What the guesses and the merit have in common with them was computed elsewhere. */
static const double *equations(kmp_solving *s)
{
    kmp_interpreter_set(s->run, KMP_IN_Q, s->y);
    if (s->block->candidates > 0) {
        (void)kmp_interpreter_run(s->run, 1);
        s->merit = *kmp_interpreter_run(s->run, 2);
    }
    return kmp_interpreter_run(s->run, s->block->program->stages - 1);
}

/* dy = -A^-1 F. false: singular. */
static bool direction(int n, const double *f, double *dy)
{
    double a[MOST * MOST];
    int pivot[MOST];
    for (int i = 0; i < n; i++) {
        dy[i] = -f[i];
        for (int j = 0; j < n; j++)
            a[i + j * n] = f[n + i * n + j];
    }
    if (kmp_lu_factor(n, a, pivot))
        return false;
    kmp_lu_solve(n, a, pivot, 1, dy);
    return isfinite(largest(n, dy));
}

/* Goes along dy, less far where the residuals are none or grow. */
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

/* Whether a step is as small as rounding makes it; `before` is the step before it. */
static bool is_last(double step, double before, double size)
{
    return step <= 2 * DBL_EPSILON * size || (step <= 1e-9 * size && step >= 0.5 * before);
}

/* From y on. */
static bool descend(kmp_solving *s)
{
    int n = s->block->unknowns;
    double dy[MOST], before = INFINITY, size = largest(n, s->y);
    const double *f = equations(s);
    for (int k = 0; k < MOST_STEPS; k++) {
        if (!direction(n, f, dy))
            return false;
        f = advance(s, dy, largest(n, f));
        double step = largest(n, dy);
        size = fmax(size, largest(n, s->y));
        if (!isfinite(step))
            return false;
        if (is_last(step, before, size))
            return isfinite(largest(n, f));
        before = step;
    }
    return false;
}

static double guess_at(kmp_solving *s, double candidate)
{
    int n = s->block->unknowns;
    memset(s->y, 0, sizeof s->y);
    s->y[0] = candidate;
    kmp_interpreter_set(s->run, KMP_IN_Q, s->y);
    const double *guess = kmp_interpreter_run(s->run, 1);
    if (n > 1) {
        memcpy(s->y + 1, guess + 1, (size_t)(n - 1) * sizeof(double));
        kmp_interpreter_set(s->run, KMP_IN_Q, s->y);
    }
    return *kmp_interpreter_run(s->run, 2);
}

/* The candidate with the least merit; -1: none has one. */
static int best_candidate(kmp_solving *s)
{
    int best = -1;
    double least = INFINITY;
    for (int k = 0; k < s->block->candidates; k++) {
        double merit = guess_at(s, s->block->candidate[k]);
        if (merit < least && isfinite(merit)) {
            least = merit;
            best = k;
        }
    }
    return best;
}

/* Where one unknown is, and between which ends the least merit is looked for. The spacing is that of the candidates
 * there; where there is one alone, Newton's first step. */
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

static valley valley_of(const kmp_block *b, int best)
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

/* Goes on to y. Where that is no place, or one behind a hill, it becomes an end; narrower hills than a thousandth of
 * the spacing are none, they are rounding. */
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

/* Whether Newton's step is the last one, as far as the one before it says: what is left after it is rounding. */
static bool is_final(double step, double before, double size)
{
    double rate = step / before;
    return is_last(step, before, size) || (step <= 1e-8 * size && step * rate * rate <= DBL_EPSILON / 4 * size);
}

/* One unknown, from its best candidate. */
static bool descend_among(kmp_solving *s, int best)
{
    valley v = valley_of(s->block, best);
    double before = INFINITY;
    if (!look(s, s->block->candidate[best], &v))
        return false;
    if (!isfinite(v.spacing))
        v.spacing = fabs(v.residual / v.slope);
    for (int k = 0; k < MOST_STEPS; k++) {
        double step = v.residual == 0 ? 0 : -v.residual / v.slope, y = v.y + step;
        double size = fmax(fabs(v.y), v.spacing);
        bool downhill = step * v.merit_slope <= 0;
        s->y[0] = y;
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

static bool solve(kmp_solving *s)
{
    int n = s->block->unknowns;
    kmp_interpreter_set(s->run, KMP_IN_PARAMETER, s->p);
    (void)kmp_interpreter_run(s->run, 0);
    if (s->block->candidates > 0) {
        int best = best_candidate(s);
        if (best >= 0 && n == 1)
            return descend_among(s, best);
        return best >= 0 && isfinite(guess_at(s, s->block->candidate[best])) && descend(s);
    }
    memcpy(s->y, kmp_interpreter_run(s->run, 1), (size_t)n * sizeof(double));
    return descend(s);
}

double kmp_solving_value(kmp_solving *s, int component)
{
    size_t bytes = (size_t)s->block->arguments * sizeof(double);
    if (!s->known || memcmp(s->p, s->solved, bytes) != 0) {
        if (!solve(s))
            for (int i = 0; i < s->block->unknowns; i++)
                s->y[i] = NAN;
        memcpy(s->solved, s->p, bytes);
        s->known = true;
    }
    return s->y[component];
}
