/* SPDX-License-Identifier: BSD-3-Clause */
/* Rows that several kinds share, and the forces and moments that they stand for: products of vectors fixed in either
 * body and of the vector d = Q - P between the points (Haug, Computer Aided Kinematics and Dynamics of Mechanical
 * Systems, 1989, sec. 9.4: the conditions dot-1, dot-2, parallel-1 and parallel-2). e is the closure's axis on a
 * point's body, a and b complete it to right-handed axes fixed there. Moments follow from virtual work: turning the
 * second body by w changes u1.u2 by w.(u2 x u1). */
#ifndef KMP_CONSTRAINTS_KINDS_PARTS_H
#define KMP_CONSTRAINTS_KINDS_PARTS_H

#include "constraints/kinds/kind.h"

/** The link of the nearest common ancestor of the two points' bodies: vectors between them are found in its axes. */
int kmp_part_frame(const kmp_tree *tree, const kmp_closure *closure);

/** d in its axes. */
kmp_vec kmp_part_gap(const kmp_tree *tree, const kmp_closure *closure);

/** v of that link's axes in those of that body, which rows that are components, forces and moments have. */
kmp_vec kmp_part_own(const kmp_tree *tree, const kmp_closure *closure, kmp_vec v);

/** e, a, b on the body of point `side` (0 or 1), axes of the frame. */
void kmp_part_axes(const kmp_tree *tree, const kmp_closure *closure, int side, kmp_vec axes[3]);

/** The points coincide: three rows. */
void kmp_part_ball(const kmp_tree *tree, const kmp_closure *closure, kmp_ref *h);

/** Q is on the line through P along e1: a1.d, b1.d; and the force. */
void kmp_part_line(const kmp_tree *tree, const kmp_closure *closure, kmp_ref *h);
kmp_vec kmp_part_line_force(const kmp_tree *tree, const kmp_closure *closure, const kmp_ref *lambda);

/** e2 is parallel to e1: a1.e2, b1.e2; and the moment. */
void kmp_part_parallel(const kmp_tree *tree, const kmp_closure *closure, kmp_ref *h);
kmp_vec kmp_part_parallel_moment(const kmp_tree *tree, const kmp_closure *closure, const kmp_ref *lambda);

/** The points' axes are parallel: the skew part of the relative rotation R, half of R32 - R23, R13 - R31, R21 - R12,
 *  which is sin(angle) times the axis of R; exact expressions, whose derivatives hold off the closure too. */
void kmp_part_aligned(const kmp_tree *tree, const kmp_closure *closure, kmp_ref *h);
kmp_vec kmp_part_aligned_moment(const kmp_tree *tree, const kmp_closure *closure, const kmp_ref *lambda);

#endif
