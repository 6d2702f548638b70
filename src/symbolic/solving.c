/* SPDX-License-Identifier: BSD-3-Clause */
/* Newton's method on a block, from its guess: steps are halved while they lead out of the domain or away. */
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
    double y[MOST];
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

/* Residuals and slopes at y. */
static const double *equations(kmp_solving *s)
{
    kmp_interpreter_set(s->run, KMP_IN_Q, s->y);
    return kmp_interpreter_run(s->run, 2);
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

static bool solve(kmp_solving *s)
{
    int n = s->block->unknowns;
    double dy[MOST], before = INFINITY, size;
    kmp_interpreter_set(s->run, KMP_IN_PARAMETER, s->p);
    (void)kmp_interpreter_run(s->run, 0);
    memcpy(s->y, kmp_interpreter_run(s->run, 1), (size_t)n * sizeof(double));
    size = largest(n, s->y);
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
