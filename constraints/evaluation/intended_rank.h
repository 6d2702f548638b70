/* SPDX-License-Identifier: BSD-3-Clause */
/* The rank that a rounded drawing means: closures that are redundant but for rounding of the model's numbers. J of such
 * a mechanism has a higher rank than the intended mechanism, with pivots of the size of the rounding, and its loops
 * close nowhere or at a few places. The intended rank is found once, when the loops are assembled
 * (constraints/closing/rounding.h), and kept in the system: every choice of rows uses it. Rows beyond it are dropped;
 * they stay open by their misfit, which is monitored. */
#pragma once

#include "dynamics/system.h"

/** NULL: closures hold as written. */
const kmp_rounding *kmp_rounding_of(const kempe_system *system);

/** True if the assembly at the start has looked for redundant closures with the present numbers; it has found none
 * after kmp_rounding_keep_none. */
bool kmp_rounding_is_known(const kempe_system *system);
void kmp_rounding_keep_none(const kempe_system *system);

/** Zero tolerance for pivots of J, and for directions of its rows: `strict`, or more if numbers are rounded. */
double kmp_rounding_zero(const kempe_system *system, double strict);
