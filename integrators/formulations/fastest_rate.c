/* SPDX-License-Identifier: BSD-3-Clause */
/* Two powers at a time: single powers of a pair of conjugate eigenvalues have no limit. The first direction has all
 * unknowns, with signs that alternate. */
#include "integrators/formulations/fastest_rate.h"
#include "base/arena.h"
#include "constraints/tolerances.h"
#include <math.h>
#include <string.h>

enum { POWERS = 7 };

/* y along the direction x, whose differences are less than `atol` of each unknown by this factor. */
static void step_along(int n, const double *y, const double *atol, double part, const double *x, double *z)
{
    for (int i = 0; i < n; i++)
        z[i] = y[i] + (atol[i] < KMP_UNCONTROLLED ? part * atol[i] * x[i] : 0);
}

/* Makes the direction the next power. Its growth. */
static double turn(int n, const double *f, const double *before, const double *atol, double part, double *x)
{
    double square = 0;
    for (int i = 0; i < n; i++) {
        x[i] = atol[i] < KMP_UNCONTROLLED ? (f[i] - before[i]) / (part * atol[i]) : 0;
        square += x[i] * x[i];
    }
    for (int i = 0; i < n && square > 0; i++)
        x[i] /= sqrt(square);
    return sqrt(square);
}

double kmp_fastest_rate(const kmp_ode *ode, double t, const double *y, const double *atol, double part)
{
    const int n = ode->n - ode->quadratures;
    kmp_arena arena = {0};
    double *x, *z, *f, *before, growth = 0, rate = 0;
    bool known = KMP_ARENA_EACH(&arena, double, ode->n, &x, &z, &f, &before) && n > 0 &&
                 ode->rhs(ode->self, t, y, before) == KMP_GO;
    for (int i = 0; known && i < n; i++)
        x[i] = (i % 2 ? -1 : 1) / sqrt(n);
    if (known)
        memcpy(z, y, (size_t)ode->n * sizeof *z);
    for (int k = 0; known && k < POWERS; k++) {
        const double last = growth;
        step_along(n, y, atol, part, x, z);
        known = ode->rhs(ode->self, t, z, f) == KMP_GO;
        growth = known ? turn(n, f, before, atol, part, x) : 0;
        rate = sqrt(growth * last);
        known = known && growth > 0;
    }
    kmp_arena_free(&arena);
    return known && isfinite(rate) ? rate : 0;
}
