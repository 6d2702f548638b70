/* SPDX-License-Identifier: BSD-3-Clause */
/* Exact derivatives of the inverse dynamics by coordinates and rates, as expressions of the same graph. By qdd it is M,
 * which is never differentiated for. */
#ifndef KMP_DYNAMICS_FORMALISMS_TANGENTS_H
#define KMP_DYNAMICS_FORMALISMS_TANGENTS_H

#include "dynamics/forces.h"

/** By recursion with composite bodies: entry (i, k) of d effort_i / d q_k at by_q[i n + k], by qd likewise, of what
 * kmp_newton_euler gives for qdd less the efforts of the forces. false: no memory. */
bool kmp_tangents_composite(const kmp_tree *tree, const kmp_ref *qdd, const kmp_forces *forces, kmp_ref *by_q,
                            kmp_ref *by_qd);

/** By differentiating n expressions by the coordinates or the rates (kind KMP_IN_Q or KMP_IN_QD). false: no memory. */
bool kmp_tangents_forward(kmp_graph *g, int n, const kmp_ref *of, kmp_input_kind kind, kmp_ref *out);

/** For an n x n matrix that is known to be symmetric: entries on one side of the diagonal stand for those on the other,
 * on the side that takes fewer operations, or on neither; what is zero on one side becomes so on the other. false: no
 * memory. */
bool kmp_tangents_mirror(const kmp_graph *g, int n, kmp_ref *matrix);

/** Which of two derivations is taken of a matrix by q, and of one by qd; operations so, and with the second of both. */
typedef struct kmp_tangent_choice {
    int by_q, by_qd;
    long operations, second;
} kmp_tangent_choice;

/** Of two derivations of each of two matrices (`count` entries; both NULL: not asked for) those that together with
 * other outputs take the fewest operations. What one derivation finds to be zero becomes so in the other. false: no
 * memory. */
bool kmp_tangents_choose(const kmp_graph *g, int others, const kmp_ref *other, int count, kmp_ref *const by_q[2],
                         kmp_ref *const by_qd[2], kmp_tangent_choice *choice);

#endif
