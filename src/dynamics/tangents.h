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
