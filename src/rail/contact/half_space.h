/* SPDX-License-Identifier: BSD-3-Clause */
/* The normal contact of two bodies: Hertz's, without dimensions, by quantities that depend only on the ratio
 * of the curvatures; of a gap in strips along the direction of rolling, without the interaction of the strips; and of
 * half-spaces, by the complete equations of elasticity on a grid of rectangles. */
#pragma once

#include "base/arena.h"
#include <kempe/rolling_contact.h>

/** The undeformed gap along the common normal. Strips lie at even distances `step` across the direction of rolling, the
 * first one at `first`. In a strip the gap is gap + along/2 (x - centre)^2. Each array has `count` members. */
typedef struct kmp_strip_gap {
    int count;
    double first, step;
    double *gap;    /* m, 0 at the least one */
    double *bend;   /* its second derivative across, 1/m */
    double *centre; /* x where the strip's gap is least, m */
    double *along;  /* relative curvature in the strip, 1/m, > 0 */
} kmp_strip_gap;

/** The contact in the strips, zero where there is none. */
typedef struct kmp_strip {
    double from, to; /* its ends along x, m */
    double pressure; /* largest in the strip, Pa */
    double load;     /* integral of the pressure over x, N/m */
} kmp_strip;

/** The whole contact. */
typedef struct kmp_normal_load_patch {
    double approach; /* of the bodies, m */
    double pressure; /* largest, Pa */
    double area;     /* m^2 */
    double place;    /* of the resultant, across, from the same origin as the strips */
    int lobes;       /* runs of strips in contact */
} kmp_normal_load_patch;

/** Solution at t = log(along / across), with G* = shear_modulus / (1 - poisson) and k = sqrt(along across):
 *
 *     a = (N / (G* k))^(1/3) axis,  approach = (N / (G* k))^(2/3) k approach,  N = G* / sqrt(k) stiffness delta^1.5.
 *
 * b is a with -t; approach and stiffness are even in t. `ratio` is log(a/b). */
typedef struct kmp_hertz {
    double ratio, axis, approach, stiffness;
} kmp_hertz;

kmp_hertz kmp_hertz_of(double t);

/** Elliptic integrals of the complementary modulus g in (0, 1]: B, D = integrals of cos^2 x, sin^2 x over sqrt(cos^2 x
 * + g^2 sin^2 x), x from 0 to pi/2. K = B + D, E = B + g^2 D. */
void kmp_elliptic(double g, double *B, double *D);

typedef enum kmp_strip_method {
    KMP_STRIPS_ANALYN, /* Sichani, Enblom, Berg 2014: Hertz's ellipse of the curvatures in each strip */
    KMP_STRIPS_KP      /* Kik, Piotrowski 1996: the region where undeformed bodies overlap by 0.55 of the approach */
} kmp_strip_method;

/** The contact under a normal force (N, > 0); modulus = G / (1 - poisson), Pa. `strip` has gap->count members, and is
 * overwritten in any case. False: no memory, or the contact would reach the first or the last strip. `pressed` is then
 * unchanged. */
bool kmp_strips_press(kmp_strip_method method, const kmp_strip_gap *gap, double modulus, double normal,
                      kmp_arena *arena, kmp_strip *strip, kmp_normal_load_patch *pressed);

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

/** The state of rolling. x is the direction of rolling; across, positions are the places of the strips. */
typedef struct kmp_rolling {
    double shear_modulus, poisson, friction;
    double slip[2], spin; /* of kempe_creep, at the origin, with y along the strips' positions */
    double origin[2];     /* x, and position across */
} kmp_rolling;

/** Forces and moment about the origin. The pressures come from kmp_half_space_press. KMP_HALF_SPACE_UNSOLVED: the
 * tractions did not become steady; `force` is then unchanged. */
kmp_half_space_result kmp_half_space_roll(const kmp_strip_gap *gap, const kmp_half_space *normal,
                                          const kmp_rolling *rolling, kmp_arena *arena, kempe_creep_force *force);
