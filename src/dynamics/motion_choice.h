/* SPDX-License-Identifier: BSD-3-Clause */
/* The choice between M and C and articulated bodies, made when articulated bodies are first asked for. */
#pragma once

#include "dynamics/system.h"

/** True if M and C of a new system wait: it is large, articulated bodies may cost less, and runs by these never need
 * C. */
bool kmp_motion_may_wait(const kempe_system *system);

/** Room for articulated bodies; NULL: no memory. */
kmp_bodies *kmp_bodies_new(void);
void kmp_bodies_free(kmp_bodies *bodies);
/** As new, with the variants to begin with. */
void kmp_bodies_forget(kmp_bodies *bodies);

/** Makes system->bodies when it is first called; no program where they were not requested and cost more or are
 * impossible. Several threads may call. KEMPE_E_FAILED: they were requested and are impossible; KEMPE_E_MEMORY. */
kempe_status kmp_motion_need_bodies(const kempe_system *system);
