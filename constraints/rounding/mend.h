/* SPDX-License-Identifier: BSD-3-Clause */
/* The exact mechanism of a rounded drawing: of all mechanisms with exactly redundant closures the one with the nearest
 * points and axes. */
#ifndef KMP_CONSTRAINTS_ROUNDING_MEND_H
#define KMP_CONSTRAINTS_ROUNDING_MEND_H

#include "constraints/closing/assemble.h"
#include "model/variant.h"

/** Makes a system as kempe_system_new for the model of a variant, with the points and axes of the exact mechanism;
 * parameters that vary keep these shifts. */
kempe_status kmp_system_of_variant(kmp_variant *variant, kempe_system **system);

/** Returns the exact mechanism of a rounded drawing; NULL: the model is exact as written. The caller frees it. */
kempe_status kmp_meant(const kempe_model *model, kmp_variant **meant);

/** Appends a sentence with the gap of a closure as drawn; nothing if it closes. */
void kmp_put_misfit(kmp_text *text, const kempe_system *system, int closure);

#endif
