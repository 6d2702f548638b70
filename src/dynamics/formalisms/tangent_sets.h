/* SPDX-License-Identifier: BSD-3-Clause */
/* The derivatives among the sets of equations.h. */
#pragma once

#include "dynamics/equations.h"
#include "dynamics/formalisms/tangents.h"

enum { KMP_TANGENT_SETS = KMP_SET_INVERSE_Q | KMP_SET_INVERSE_QD | KMP_SET_CLOSED_Q };

/** Derives eq->inverse_q, eq->inverse_qd and, if requested, eq->closed_q, after the other sets. It uses the variants of
 * eq, or those with the fewest operations, which it then stores in eq. `tree`: the links of the dynamics; jt_lambda: J'
 * lambda. False: no memory. */
bool kmp_tangent_sets_derive(kmp_equations *eq, const kmp_tree *tree, const kmp_forces *forces, unsigned sets,
                             const kmp_ref *jt_lambda);
