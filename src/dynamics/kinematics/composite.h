/* SPDX-License-Identifier: BSD-3-Clause */
/* Mass, first and second moments of bodies about a point: what rigid bodies that move together are as one. */
#ifndef KMP_DYNAMICS_KINEMATICS_COMPOSITE_H
#define KMP_DYNAMICS_KINEMATICS_COMPOSITE_H

#include "dynamics/kinematics/tensor.h"

typedef struct kmp_composite {
    kmp_ref mass;
    kmp_vec moment;     /* sum m x */
    kmp_tensor inertia; /* sum m (x.x 1 - x x'); or sum m x x' where it says so (spread.h) */
} kmp_composite;

/** Of a body with its centre of mass at `com` and its inertia about that. */
kmp_composite kmp_composite_of(kmp_graph *g, kmp_ref mass, kmp_vec com, kmp_tensor inertia);

kmp_composite kmp_composite_add(kmp_graph *g, kmp_composite a, kmp_composite b);

/** The same about a point d before its own. */
kmp_composite kmp_composite_shifted(kmp_graph *g, kmp_composite c, kmp_vec d);

/** With b the first moment, b' = b + m d the new one, put in c->moment. What is added to second moments has b and b',
 *  or, where m and d are numbers, b twice and m d apart, which is a number then and joins what else is constant:
 *  returns which of both, the other one in *other. */
bool kmp_composite_moved(kmp_graph *g, kmp_composite *c, kmp_vec d, kmp_vec *other);

/** d (a + b): 2 d, mostly a number or a parameter, once if both are one. */
kmp_ref kmp_composite_both(kmp_graph *g, kmp_ref d, kmp_ref a, kmp_ref b);

#endif
