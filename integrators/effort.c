/* SPDX-License-Identifier: BSD-3-Clause */
#include "integrators/effort.h"
#include "base/memory.h"
#include <math.h>
#include <string.h>

bool kmp_effort_init(kmp_effort *effort, const kempe_system *system)
{
    size_t n = (size_t)system->n;
    *effort = (kmp_effort){.n = system->n};
    if (!system->force)
        return true;
    effort->system = system;
    effort->value = KMP_NEW(double, n);
    effort->moved = KMP_NEW(double, n);
    effort->state = KMP_NEW(double, 2 * n);
    effort->tangent = KMP_NEW(double, 2 * n * n);
    return effort->value && effort->moved && effort->state && effort->tangent;
}

void kmp_effort_free(kmp_effort *effort)
{
    kmp_free(effort->value);
    kmp_free(effort->moved);
    kmp_free(effort->state);
    kmp_free(effort->tangent);
    *effort = (kmp_effort){0};
}

void kmp_effort_eval(kmp_effort *effort, double t, const double *q, const double *qd)
{
    kmp_system_effort(effort->system, t, q, qd, effort->value);
}

/* An increment that is exact in binary, of the root of the rounding of the coordinate or of its scale. */
static double increment(const kmp_effort *effort, int k)
{
    double size = fmax(fabs(effort->state[k]), effort->system->scale[k % effort->n]);
    volatile double moved = effort->state[k] + 1.5e-8 * size;
    return moved - effort->state[k];
}

void kmp_effort_differentiate(kmp_effort *effort, double t, const double *q, const double *qd)
{
    int n = effort->n;
    kmp_effort_eval(effort, t, q, qd);
    memcpy(effort->state, q, (size_t)n * sizeof *q);
    memcpy(effort->state + n, qd, (size_t)n * sizeof *qd);
    for (int k = 0; k < 2 * n; k++) {
        double kept = effort->state[k], d = increment(effort, k);
        effort->state[k] += d;
        kmp_system_effort(effort->system, t, effort->state, effort->state + n, effort->moved);
        for (int i = 0; i < n; i++)
            effort->tangent[i + k * n] = (effort->moved[i] - effort->value[i]) / d;
        effort->state[k] = kept;
    }
}
