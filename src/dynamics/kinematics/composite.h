/* SPDX-License-Identifier: BSD-3-Clause */
/* Mass, first and second moments of bodies about a point: rigid bodies that move together as one body. */
#pragma once

#include "dynamics/kinematics/tensor.h"

typedef struct kmp_composite {
    kmp_ref mass;
    kmp_vec moment;     /* sum m x */
    kmp_tensor inertia; /* K = sum m (x.x 1 - x x'); or P = sum m x x' with kmp_tree.spread */
} kmp_composite;

/** The moments of a body with its centre of mass at `com` and its inertia about that point. */
kmp_composite kmp_composite_of(kmp_graph *g, kmp_ref mass, kmp_vec com, kmp_tensor inertia);

kmp_composite kmp_composite_add(kmp_graph *g, kmp_composite a, kmp_composite b);

/** The moments about a point d before the composite's own. */
kmp_composite kmp_composite_shifted(kmp_graph *g, kmp_composite c, kmp_vec d);

/* Pseudo-inertia: second moments as P = sum m x x' instead of K = tr(P) 1 - P. A change of origin adds one product to
 * each of three diagonal entries, but an axis' column of K takes a sum. In the plane P has three entries and K has one.
 */

/** P of K: tr(K)/2 1 - K. */
kmp_tensor kmp_tensor_spread(kmp_graph *g, kmp_tensor inertia);
/** K e for e along a coordinate axis. */
kmp_vec kmp_spread_column(kmp_graph *g, kmp_tensor spread, int axis);
/** kmp_composite_shifted with P for the inertia. */
kmp_composite kmp_spread_shifted(kmp_graph *g, kmp_composite c, kmp_vec d);
