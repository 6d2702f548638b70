/* SPDX-License-Identifier: BSD-3-Clause */
/* The rows of all closures: h, J, h_t, their rates and jdqd. */
#pragma once

#include "dynamics/equations.h"
#include "model/data/force.h"

/** Derives the sets that the request requests. KEMPE_E_INPUT when a closure can never be met, KEMPE_E_MEMORY. */
kempe_status kmp_closures_derive(kmp_equations *eq, const kmp_derivation_request *request);

/** J' times the inputs of a kind, which has an entry a row: out (n). */
void kmp_closures_transposed(kmp_equations *eq, kmp_input_kind kind, kmp_ref *out);

/** The force, or the moment, of a closure's multipliers, which are inputs (constraints/kinds/kind.h), in ground axes.
 */
kmp_vec kmp_closure_load(const kmp_tree *tree, int closure, bool moment);
