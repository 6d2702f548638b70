/* SPDX-License-Identifier: BSD-3-Clause */
/* The growth of levels with friction: the largest row sum of |dF_i/df_j|, with levels F that depend on multipliers,
 * which depend on the friction f. Below 1 the iteration for levels contracts, so that there is one solution. */
#pragma once

#include "integrators/friction/friction_site.h"

/** The growth of levels with friction at a state, and the element whose level grows most. No row is held afterwards. */
KMP_LOCAL int kmp_friction_grow(kmp_friction_run *x, double t, const double *q, const double *qd, double *growth,
                                int *most);

/** Fails with the elements that can neither slip nor stick, and the growth of a level if that is the reason. */
KMP_LOCAL int kmp_friction_complain(kmp_friction_run *x, double t, const double *q, const double *qd);
