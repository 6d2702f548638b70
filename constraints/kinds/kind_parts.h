/* SPDX-License-Identifier: BSD-3-Clause */
/* Closure parts between two points: products of vectors fixed in either body and of the vector d = Q - P between the
 * points (Haug, Computer Aided Kinematics and Dynamics of Mechanical Systems, 1989, sec. 9.4: the
 * conditions dot-1, dot-2, parallel-1 and parallel-2). e is the closure's axis on a point's body, a and b complete it
 * to right-handed axes fixed there. Moments follow from virtual work: turning the second body by w changes u1.u2 by
 * w.(u2 x u1). */
#pragma once

#include "constraints/kinds/kind.h"

/** The link of the nearest common ancestor of the two points' bodies: vectors between them are found in its axes. */
int kmp_part_frame(const kmp_tree *tree, const kmp_closure *closure);

/** d in the axes of kmp_part_frame. */
kmp_vec kmp_part_gap(const kmp_tree *tree, const kmp_closure *closure);

/** Turns v from the axes of kmp_part_frame into the axes of the ancestor's body, used for rows, forces and moments. */
kmp_vec kmp_part_own(const kmp_tree *tree, const kmp_closure *closure, kmp_vec v);
