/* SPDX-License-Identifier: BSD-3-Clause */
/* The programs that make accelerations: by M and C, and by articulated bodies where that was asked for or costs less.
 */
#ifndef KMP_DYNAMICS_MOTION_H
#define KMP_DYNAMICS_MOTION_H

#include "dynamics/system.h"

/** What the first of them needs. */
enum { KMP_MOTION_SETS = KMP_SET_MASS | KMP_SET_BIAS | KMP_SET_CLOSURE | KMP_SET_JDQD | KMP_SET_POWER };

/** system->motion and what belongs to it, of a system that knows its rows. false: no memory. */
bool kmp_motion_make(kempe_system *system, kmp_equations *eq);

/** system->articulated, after that; none where it was not asked for and costs more or cannot be had. KEMPE_E_FAILED: it
 *  was asked for and cannot be had; KEMPE_E_MEMORY. */
kempe_status kmp_motion_add_articulated(kempe_system *system);

#endif
