/* SPDX-License-Identifier: BSD-3-Clause */
/* The laws of rolling contact (kempe/rolling_contact.h) as expressions, with all derivatives.
 *
 * They are smooth and finite everywhere, also without creep and without a normal force. Sizes of creepages have a floor
 * of 1e-15, sizes of forces one of 1e-12 of friction times normal force. The normal force in a power has a floor of
 * 1e-14 G* / (along + across)^2, some 1e-4 N for a wheel on a rail. With a negative normal force the size of the
 * ellipse follows from its modulus, and the forces are reversed. Polach's law has kinks where y and y + a spin are
 * equal in size.
 */
#pragma once

#include "model/data/wheels.h"
#include "symbolic/graph.h"

/** Two like bodies touching in a point. Curvatures are relative, the sum of both bodies', 1/m, positive. */
typedef struct kmp_touch {
    kmp_ref along, across; /* curvature in the direction of rolling, and lateral */
    kmp_ref shear_modulus; /* of both */
    double poisson;        /* 0 to 0.5 */
} kmp_touch;

/** Hertz: N = stiffness * penetration^1.5, and the semi-axes a (along) and b (across) for N. */
kmp_ref kmp_hertz_stiffness(kmp_graph *g, const kmp_touch *touch);
void kmp_hertz_axes(kmp_graph *g, const kmp_touch *touch, kmp_ref normal, kmp_ref semi[2]);

typedef struct kmp_creep {
    kmp_touch touch;
    kmp_ref normal;        /* N, not negative */
    kmp_ref friction;      /* coefficient, not negative */
    kmp_ref slip[2], spin; /* creepages along and across, and spin in 1/m: of the wheel against the rail, over the
                            * rolling speed; axes along, across, normal are right-handed */
} kmp_creep;

/** The force on the wheel along and across, N, and its moment about the normal, N m. */
typedef struct kmp_creep_force {
    kmp_ref force[2], moment;
} kmp_creep_force;

void kmp_creep_law_force(kmp_graph *g, kmp_creep_law law, const kmp_creep *creep, kmp_creep_force *out);
