/* SPDX-License-Identifier: BSD-3-Clause */
/* Exact derivatives of the inverse dynamics by coordinates and rates, as expressions of the same graph. By qdd it is M,
 * which needs no differentiation. */
#pragma once

#include "dynamics/forces/forces.h"

/** Derivatives by recursion with composite bodies: entry (i, k) of d effort_i / d q_k at by_q[i n + k], by qd in by_qd.
 * They are derivatives of kmp_newton_euler's result for qdd less the generalized forces of the forces. The n
 * derivatives of the power of the forces go to `power_q` and `power_qd`; NULL: not requested. The graph fails when
 * there is no memory. */
void kmp_tangents_composite(const kmp_tree *tree, const kmp_ref *qdd, const kmp_forces *forces, kmp_ref *by_q,
                            kmp_ref *by_qd, kmp_ref *power_q, kmp_ref *power_qd);

/** The chosen derivation of a matrix by q, and of one by qd; operations of this choice, and with the second derivation
 * of both. */
typedef struct kmp_tangent_choice {
    int by_q, by_qd;
    long operations, second;
} kmp_tangent_choice;

/** For an n x n matrix that is known to be symmetric: entries of the side with fewer operations replace the entries on
 * the other side of the diagonal, if there is a difference. Entries that are zero on one side become zero on the other.
 * False: no memory. */
bool kmp_tangents_mirror(const kmp_graph *g, int n, kmp_ref *matrix);

/** Chooses, from two derivations of each of two matrices (`count` entries; both NULL: not requested), the entries
 * that together with other outputs take the fewest operations. Entries that are zero in one derivation become zero in
 * the other. False: no memory. */
bool kmp_tangents_choose(const kmp_graph *g, int others, const kmp_ref *other, int count, kmp_ref *const by_q[2],
                         kmp_ref *const by_qd[2], kmp_tangent_choice *choice);
