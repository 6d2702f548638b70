/* SPDX-License-Identifier: BSD-3-Clause */
/* The growth of levels with friction: the largest row sum of |dF_i/df_j|, with levels F that depend on multipliers,
 * which depend on the friction f. Below 1 the iteration for levels contracts, so that there is one solution. */
#include "integrators/friction/friction_growth.h"
#include "constraints/tolerances.h"
#include "integrators/friction/friction_elements.h"
#include "integrators/friction/friction_inside.h"
#include <math.h>

static double level_of(const kmp_friction_run *x, int i)
{
    return kmp_friction_level_at(x, &x->element[i], KMP_ROLE_LEVEL);
}

static int add_column(kmp_friction_run *x, int j, double t, const double *q, const double *qd)
{
    double unit = KMP_FRICTION_UNIT * (x->tried[j] > 0 ? x->tried[j] : 1); /* the sizes of reactions have kinks */
    kmp_friction_set_given(x, &x->element[j], unit, 0);
    KMP_FRICTION_TRY(kmp_friction_measure(x, t, q, qd));
    for (int i = 0; i < x->count; i++)
        x->aside[i] += fabs(level_of(x, i) - x->tried[i]) / unit;
    kmp_friction_set_given(x, &x->element[j], 0, 0);
    return 0;
}

KMP_LOCAL int kmp_friction_grow(kmp_friction_run *x, double t, const double *q, const double *qd, double *growth,
                                int *most)
{
    *growth = 0;
    *most = 0;
    for (int i = 0; i < x->count; i++)
        kmp_friction_set_given(x, &x->element[i], 0, 0);
    KMP_FRICTION_TRY(kmp_friction_choose(x, t, q));
    KMP_FRICTION_TRY(kmp_friction_measure(x, t, q, qd));
    for (int i = 0; i < x->count; i++) {
        x->tried[i] = level_of(x, i);
        x->aside[i] = 0;
    }
    for (int j = 0; j < x->count; j++)
        if (!x->element[j].contact) /* the force of a contact is no friction */
            KMP_FRICTION_TRY(add_column(x, j, t, q, qd));
    for (int i = 0; i < x->count; i++) {
        *most = x->aside[i] > *growth ? i : *most;
        *growth = fmax(*growth, x->aside[i]);
    }
    if (x->site->forget_loads)
        x->site->forget_loads(x->site->self);
    return 0;
}

KMP_LOCAL int kmp_friction_complain(kmp_friction_run *x, double t, const double *q, const double *qd)
{
    for (int k = 0; k < x->rest; k++)
        x->element[x->which[k]].tries = true;
    if (kmp_friction_grow(x, t, q, qd, &x->growth, &x->most) != 0)
        x->growth = 0;
    x->site->forget(x->site->self);
    return x->site->fail(x->site->self, KMP_FRICTION_IMPOSSIBLE, t);
}
