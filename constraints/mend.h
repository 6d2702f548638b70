/* SPDX-License-Identifier: BSD-3-Clause */
/* The mechanism that a rounded drawing means: of all mechanisms whose redundant closures say exactly the same the one
 * with the nearest points and axes. */
#ifndef KMP_CONSTRAINTS_MEND_H
#define KMP_CONSTRAINTS_MEND_H

#include "constraints/assemble.h"
#include "model/variant.h"

/** As kempe_system_new, of the model of a variant, whose points and axes are then those that the drawing means: where
 * parameters vary they are shifted by as much. */
kempe_status kmp_system_of_variant(kmp_variant *variant, kempe_system **system);

/** The mechanism that a drawing means; NULL: the model says what it means. The caller frees it. */
kempe_status kmp_meant(const kempe_model *model, kmp_variant **meant);

/** What a closure stays open by as drawn, as a sentence; nothing where it closes. */
void kmp_put_misfit(kmp_text *text, const kempe_system *system, int closure);

#endif
