/* SPDX-License-Identifier: BSD-3-Clause */
/* Mass, first and second moments of bodies about a point: rigid bodies that move together as one body. */
#pragma once

#include "dynamics/kinematics/tensor.h"

typedef struct kmp_composite {
    kmp_ref mass;
    kmp_vec moment;     /* sum m x */
    kmp_tensor inertia; /* K = sum m (x.x 1 - x x') */
} kmp_composite;

/** The moments of a body with its centre of mass at `com` and its inertia about that point. */
kmp_composite kmp_composite_of(kmp_graph *g, kmp_ref mass, kmp_vec com, kmp_tensor inertia);

kmp_composite kmp_composite_add(kmp_graph *g, kmp_composite a, kmp_composite b);

/** The moments about a point d before the composite's own. */
kmp_composite kmp_composite_shifted(kmp_graph *g, kmp_composite c, kmp_vec d);
