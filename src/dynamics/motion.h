/* SPDX-License-Identifier: BSD-3-Clause */
/* The programs that make accelerations: by M and C, and by articulated bodies where those were requested or cost less.
 */
#pragma once

#include "dynamics/system.h"

/** The sets for accelerations by M and C. */
enum { KMP_MOTION_SETS = KMP_SET_MASS | KMP_SET_BIAS | KMP_SET_CLOSURE | KMP_SET_JDQD | KMP_SET_POWER };

/** Makes system->motion and its members, for a system that knows its rows. False: no memory. */
bool kmp_motion_make(kempe_system *system, kmp_equations *eq);

/** Makes the program and patterns of articulated bodies. False: no memory. */
bool kmp_motion_make_bodies(const kempe_system *system, kmp_bodies *bodies, kmp_equations *eq);

/** Room for articulated bodies; NULL: no memory. */
kmp_bodies *kmp_bodies_new(void);
void kmp_bodies_free(kmp_bodies *bodies);
/** As new, with the variants to begin with. */
void kmp_bodies_forget(kmp_bodies *bodies);

/** Makes system->bodies when it is first called; no program where they were not requested and cost more or are
 * impossible. Several threads may call. KEMPE_E_FAILED: they were requested and are impossible; KEMPE_E_MEMORY. */
kempe_status kmp_motion_need_bodies(const kempe_system *system);
