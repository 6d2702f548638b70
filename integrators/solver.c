/* SPDX-License-Identifier: BSD-3-Clause */
#include "integrators/solver.h"
#include <string.h>

static const kmp_solver_kind *const kinds[] = {
#define KMP_SOLVER(name) &kmp_solver_##name,
#include "integrators/integrators.def"
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

#define HOPELESS 1e9
enum { MAX_HOPELESS = 100 };

bool kmp_solver_collapsed(int *hopeless, double h, double left)
{
    *hopeless = HOPELESS * h < left ? *hopeless + 1 : 0;
    return *hopeless > MAX_HOPELESS;
}
