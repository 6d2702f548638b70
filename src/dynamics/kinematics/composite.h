/* SPDX-License-Identifier: BSD-3-Clause */
/* Mass, first and second moments of bodies about a point: rigid bodies that move together as one body. */
#ifndef KMP_DYNAMICS_KINEMATICS_COMPOSITE_H
#define KMP_DYNAMICS_KINEMATICS_COMPOSITE_H

#include "dynamics/kinematics/tensor.h"

typedef struct kmp_composite {
    kmp_ref mass;
    kmp_vec moment;     /* sum m x */
    kmp_tensor inertia; /* sum m (x.x 1 - x x'); or sum m x x' with kmp_tree.spread (shorten/pseudo_inertia.h) */
} kmp_composite;

/** The moments of a body with its centre of mass at `com` and its inertia about that point. */
kmp_composite kmp_composite_of(kmp_graph *g, kmp_ref mass, kmp_vec com, kmp_tensor inertia);

kmp_composite kmp_composite_add(kmp_graph *g, kmp_composite a, kmp_composite b);

/** The moments about a point d before the composite's own. */
kmp_composite kmp_composite_shifted(kmp_graph *g, kmp_composite c, kmp_vec d);

/** With b the first moment, b' = b + m d the new one, put in c->moment. The increment of second moments contains b and
 * b'. Where m and d are numbers, it contains twice b and, separately, m d, which then joins other constants. Returns
 * true in the second case, with the other vector in *other. */
bool kmp_composite_moved(kmp_graph *g, kmp_composite *c, kmp_vec d, kmp_vec *other);

/** d (a + b): 2 d, mostly a number or a parameter, once if both are one. */
kmp_ref kmp_composite_both(kmp_graph *g, kmp_ref d, kmp_ref a, kmp_ref b);

#endif
