/* SPDX-License-Identifier: BSD-3-Clause */
/* Accelerations in O(N): articulated bodies, x = M^-1 f without M (Featherstone 1983; the "O(N) scheme" that Fisette
 * and Samin 1996 compare with, section 2.3). */
#pragma once

#include "dynamics/formalisms/newton_euler.h"

/** In the room of the tree's graph, values of the recursion for each joint: its inertia S.U and U / S.U, the wrench
 * that a unit generalized force transmits. */
typedef struct kmp_articulated {
    const kmp_tree *tree;
    kmp_ref *inverse;   /* 1 / S.U of each link */
    kmp_wrench *passed; /* U / S.U; the component along the joint is 1 and is not stored */
    kmp_wrench *down;   /* work space of a solve */
} kmp_articulated;

/** Articulated inertias from the leaves inwards. KEMPE_E_FAILED: a joint that moves no mass, S.U = 0, by name;
 *  KEMPE_E_MEMORY. */
kempe_status kmp_articulated_init(kmp_articulated *a, const kmp_tree *tree);

/** The accelerations (n) by the generalized forces (n, NULL: none), where link i needs the wrench share[i] at qdd = 0
 * (NULL: nothing): M qdd = effort - C. Without shares qdd = M^-1 effort. */
void kmp_articulated_solve(kmp_articulated *a, const kmp_ref *effort, const kmp_wrench *share, kmp_ref *qdd);
