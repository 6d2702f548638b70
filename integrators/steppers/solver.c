/* SPDX-License-Identifier: BSD-3-Clause */
#include "integrators/steppers/solver.h"
#include <float.h>
#include <math.h>
#include <string.h>

static const kmp_solver_kind *const kinds[] = {
#define KMP_SOLVER(name) &kmp_solver_##name,
#include "integrators/steppers/integrators.def"
#undef KMP_SOLVER
};

const kmp_solver_kind *kmp_solver_get(int k)
{
    return k >= 0 && k < (int)(sizeof kinds / sizeof *kinds) ? kinds[k] : NULL;
}

const kmp_solver_kind *kmp_solver_find(const char *name)
{
    for (size_t k = 0; k < sizeof kinds / sizeof *kinds; k++)
        if (strcmp(kinds[k]->name, name) == 0)
            return kinds[k];
    return NULL;
}

/* Parts of t, in units of rounding: LEAST bounds a step; repeated steps below COLLAPSED are a collapse. */
static const double LEAST = 16, COLLAPSED = 64;
enum { MAX_HOPELESS = 100 };

double kmp_solver_least_step(double t)
{
    return LEAST * DBL_EPSILON * fabs(t);
}

double kmp_solver_next_step(double t, double t_end, double next, double *t_new)
{
    double left = t_end - t;
    double h = left < 1.01 * next ? left : left < 2.0 * next ? 0.5 * left : next;
    *t_new = h == left ? t_end : t + h;
    return h >= kmp_solver_least_step(t) && *t_new > t ? h : 0;
}

bool kmp_solver_collapsed(int *hopeless, double h, double t)
{
    *hopeless = h < COLLAPSED * DBL_EPSILON * fabs(t) ? *hopeless + 1 : 0;
    return *hopeless > MAX_HOPELESS;
}
