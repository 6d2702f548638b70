/* SPDX-License-Identifier: BSD-3-Clause */
/* Pseudo-inertia: second moments as P = sum m x x' instead of the inertia K = tr(P) 1 - P. A change of origin adds one
 * product to each of three diagonal entries, but an axis' column of K takes a sum. In the plane P has three entries and
 * K has one. */
#ifndef KMP_DYNAMICS_SHORTEN_PSEUDO_INERTIA_H
#define KMP_DYNAMICS_SHORTEN_PSEUDO_INERTIA_H

#include "dynamics/kinematics/kinematics.h"

/** Uses P for each link's `base` from now on; axes turn with the links. */
void kmp_spread_out(kmp_tree *tree);

/** K e for e along a coordinate axis. */
kmp_vec kmp_spread_column(kmp_graph *g, kmp_tensor spread, int axis);

/** kmp_composite_shifted with P for the inertia. */
kmp_composite kmp_spread_shifted(kmp_graph *g, kmp_composite c, kmp_vec d);

#endif
