/* SPDX-License-Identifier: BSD-3-Clause */
/* The normal contact of two half-spaces whose gap is given in strips: the complete equations of elasticity, on a grid
 * of rectangles. */
#pragma once

#include "base/arena.h"
#include "rail/contact/gap.h"
#include <kempe/rolling_contact.h>

typedef enum kmp_half_space_result {
    KMP_HALF_SPACE_SOLVED,
    KMP_HALF_SPACE_MEMORY,
    KMP_HALF_SPACE_LARGE,   /* the contact reaches the first or the last strip */
    KMP_HALF_SPACE_UNSOLVED /* the pressures did not converge */
} kmp_half_space_result;

/** A solution, with its pressures: rectangles of dx by the gap's step, row by row. The centre of the first one is at x
 * = first. */
typedef struct kmp_half_space {
    int columns, iterations;
    double first, dx;
    double *pressure; /* gap->count rows; in the arena */
} kmp_half_space;

/** The contact under a normal force (N, > 0); modulus = G / (1 - poisson), Pa. `strip` has gap->count members: on entry
 * an approximation, in rows that may be in contact, then the solution; likewise pressed->approach. `cells` along the
 * longest strip. */
kmp_half_space_result kmp_half_space_press(const kmp_strip_gap *gap, double modulus, double normal, int cells,
                                           kmp_arena *arena, kmp_strip *strip, kmp_normal_load_patch *pressed,
                                           kmp_half_space *solution);

/* Steady rolling of two half-spaces with the same elasticity, on the grid of their normal contact. */

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
