/* SPDX-License-Identifier: BSD-3-Clause */
/* The programs that make accelerations: by M and C, and by articulated bodies where those were requested or cost less.
 */
#pragma once

#include "dynamics/system.h"

/** The sets for accelerations by M and C. */
enum { KMP_MOTION_SETS = KMP_SET_MASS | KMP_SET_BIAS | KMP_SET_CLOSURE | KMP_SET_JDQD | KMP_SET_POWER };

/** Makes system->motion and its members, for a system that knows its rows. False: no memory. */
bool kmp_motion_make(kempe_system *system, kmp_equations *eq);

/** Makes system->articulated afterwards; none where it was not requested and costs more or is impossible.
 * `first`: the variants that M and C have, or none. KEMPE_E_FAILED: it was requested and is impossible; KEMPE_E_MEMORY.
 */
kempe_status kmp_motion_add_articulated(kempe_system *system, const kmp_savings *first);
