/* SPDX-License-Identifier: BSD-3-Clause */
/* Variants of equations of equal value: the shortest is found by counting operations. */
#pragma once

#include "dynamics/equations.h"
#include "model/data/force.h"

/** KEMPE_E_INPUT when a closure can never be met (a row that no coordinate moves). KEMPE_E_FAILED when accelerations
 * are requested and a coordinate moves no mass. KEMPE_E_MEMORY. */
kempe_status kmp_equations_derive(kmp_equations *eq, const kempe_model *model, const kmp_derivation_request *scene);

/** True of a mechanism whose number of coordinates is so large that few variants are tried, and trials have no force
 * elements. */
bool kmp_equations_are_large(const kempe_model *model);

/** kmp_equations_outputs: collects the nonzero outputs of sets, with room for kmp_equations_most_outputs; returns their
 * number. */
int kmp_equations_most_outputs(const kmp_equations *eq);
int kmp_equations_outputs(const kmp_equations *eq, unsigned sets, kmp_ref *out);
