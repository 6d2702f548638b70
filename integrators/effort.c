/* SPDX-License-Identifier: BSD-3-Clause */
#include "integrators/effort.h"
#include "base/memory.h"
#include <math.h>
#include <string.h>

bool kmp_effort_init(kmp_effort *effort, kmp_plant *plant)
{
    size_t n = (size_t)plant->n;
    *effort = (kmp_effort){.n = plant->n};
    if (!plant->system->force)
        return true;
    effort->plant = plant;
    effort->base = KMP_NEW(double, n);
    effort->state = KMP_NEW(double, 2 * n);
    effort->tangent = KMP_NEW(double, 2 * n * n);
    return effort->base && effort->state && effort->tangent;
}

void kmp_effort_free(kmp_effort *effort)
{
    kmp_free(effort->base);
    kmp_free(effort->state);
    kmp_free(effort->tangent);
    *effort = (kmp_effort){0};
}

void kmp_effort_subtract(kmp_effort *effort, double t, const double *q, const double *qd, double *r)
{
    if (!effort->plant)
        return;
    const double *value = kmp_plant_effort(effort->plant, t, q, qd);
    for (int i = 0; i < effort->n; i++)
        r[i] -= value[i];
}

/* An increment that is exact in binary, of the root of the rounding of the coordinate or of its scale. */
static double increment(const kmp_effort *effort, int k)
{
    double size = fmax(fabs(effort->state[k]), effort->plant->system->scale[k % effort->n]);
    volatile double moved = effort->state[k] + 1.5e-8 * size;
    return moved - effort->state[k];
}

void kmp_effort_differentiate(kmp_effort *effort, double t, const double *q, const double *qd)
{
    int n = effort->n;
    if (!effort->plant)
        return;
    memcpy(effort->base, kmp_plant_effort(effort->plant, t, q, qd), (size_t)n * sizeof *effort->base);
    memcpy(effort->state, q, (size_t)n * sizeof *q);
    memcpy(effort->state + n, qd, (size_t)n * sizeof *qd);
    for (int k = 0; k < 2 * n; k++) {
        double kept = effort->state[k], d = increment(effort, k);
        effort->state[k] += d;
        const double *value = kmp_plant_effort(effort->plant, t, effort->state, effort->state + n);
        for (int i = 0; i < n; i++)
            effort->tangent[i + k * n] = (value[i] - effort->base[i]) / d;
        effort->state[k] = kept;
    }
}
