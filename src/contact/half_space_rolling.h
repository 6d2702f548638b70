/* SPDX-License-Identifier: BSD-3-Clause */
/* Steady rolling of two half-spaces with the same elasticity, on the grid of their normal contact. */
#pragma once

#include "base/arena.h"
#include "contact/half_space.h"
#include <kempe/contact.h>

/** The state of rolling. x is the direction of rolling; across, positions are those of the strips. */
typedef struct kmp_rolling {
    double shear_modulus, poisson, friction;
    double slip[2], spin; /* of kempe_creep, at the origin, with y along the strips' positions */
    double origin[2];     /* x, and position across */
} kmp_rolling;

/** Forces and moment about the origin. The pressures are those of kmp_half_space_press. KMP_HALF_SPACE_UNSOLVED: the
 * tractions did not become steady; `force` is then unchanged. */
kmp_half_space_result kmp_half_space_roll(const kmp_strip_gap *gap, const kmp_half_space *normal,
                                          const kmp_rolling *rolling, kmp_arena *arena, kempe_creep_force *force);
