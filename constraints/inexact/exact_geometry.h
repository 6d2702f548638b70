/* SPDX-License-Identifier: BSD-3-Clause */
/* Numbers of a drawing for which its closures are redundant in all configurations. */
#pragma once

#include "constraints/inexact/nearest_exact.h"

/** Shifts the numbers of the variant if there is an exact mechanism. Its model is that of a rounded system, closures
 * alone, or equal to it; `a` is the system's assembly. *by: the largest shift, scaled. KEMPE_E_MEMORY. */
kempe_status kmp_exact_find(const kempe_system *system, const kempe_assembly *a, kmp_variant *variant,
                            kmp_drawn_model *found, double *by);
