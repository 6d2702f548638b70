/* SPDX-License-Identifier: BSD-3-Clause */
/* The mechanism that a rounded drawing means: of all mechanisms whose redundant closures say exactly the same the one
 * with the nearest points and axes. */
#ifndef KMP_CONSTRAINTS_ROUNDING_MEND_H
#define KMP_CONSTRAINTS_ROUNDING_MEND_H

#include "constraints/closing/assemble.h"
#include "model/variant.h"

/** Does kempe_system_new for the model of a variant, with the points and axes that a rounded drawing means;
 * parameters that vary keep these shifts. */
kempe_status kmp_system_of_variant(kmp_variant *variant, kempe_system **system);

/** Returns the mechanism that a rounded drawing means; NULL: the model is exact as written. The caller frees it. */
kempe_status kmp_meant(const kempe_model *model, kmp_variant **meant);

/** What a closure stays open by as drawn, as a sentence; nothing where it closes. */
void kmp_put_misfit(kmp_text *text, const kempe_system *system, int closure);

#endif
