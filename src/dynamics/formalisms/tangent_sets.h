/* SPDX-License-Identifier: BSD-3-Clause */
/* The derivatives among the sets of equations.h. */
#ifndef KMP_DYNAMICS_FORMALISMS_TANGENT_SETS_H
#define KMP_DYNAMICS_FORMALISMS_TANGENT_SETS_H

#include "dynamics/equations.h"
#include "dynamics/formalisms/tangents.h"

enum { KMP_TANGENT_SETS = KMP_SET_INVERSE_Q | KMP_SET_INVERSE_QD | KMP_SET_CLOSED_Q };

/** eq->inverse_q, eq->inverse_qd and, where it is asked for, eq->closed_q, when the other sets are there: by the ways
 * of eq or those with the fewest operations, which are then its ways. `tree`: the links as the dynamics see them;
 * jt_lambda: J' lambda. false: no memory. */
bool kmp_tangent_sets_derive(kmp_equations *eq, const kmp_tree *tree, const kmp_forces *forces, unsigned sets,
                             const kmp_ref *jt_lambda);

#endif
