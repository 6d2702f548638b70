/* SPDX-License-Identifier: BSD-3-Clause */
/* The exact mechanism near a rounded drawing: the smallest shift of the model's numbers with which redundant closures
 * hold in all configurations. */
#ifndef KMP_CONSTRAINTS_ROUNDING_EXACT_H
#define KMP_CONSTRAINTS_ROUNDING_EXACT_H

#include "constraints/closing/assemble.h"
#include "model/variant.h"
#include <kempe/check.h>

/** A rounded drawing has an exact mechanism nearby; or rows stay open, explained by rounding of its numbers or not. */
typedef enum kmp_drawn_model { KMP_DRAWING_OPEN, KMP_DRAWING_UNEXPLAINED, KMP_DRAWING_EXACT } kmp_drawn_model;

/** Shifts the numbers of the variant if there is an exact mechanism. Its model is that of a rounded system, closures
 * alone, or equal to it; `a` is the system's assembly. *by: the largest shift, scaled. KEMPE_E_MEMORY. */
kempe_status kmp_exact_find(const kempe_system *system, const kempe_assembly *a, kmp_variant *variant,
                            kmp_drawn_model *found, double *by);

#endif
