/* SPDX-License-Identifier: BSD-3-Clause */
/* A system in place of one with sampled states, for studies of small motions: each sampled state y has the rate
 * (next - y)/T, T being the time between its samples. Its equilibria are those of the samples, where y is `next`, and
 * its linear equations contain those of the samples (derivatives/sampled_motion.h). */
#pragma once

#include "dynamics/system.h"

typedef struct kmp_averaged kmp_averaged;

/** *averaged: NULL for a model without sampled states. KEMPE_E_ARGUMENT: a state changes at events; `what` begins the
 * message. */
kempe_status kmp_averaged_new(const kempe_system *given, const char *what, kmp_averaged **averaged);
void kmp_averaged_free(kmp_averaged *averaged);

/** Its system, which has the model's names and its user's force; `given` where there is none. */
const kempe_system *kmp_averaged_system(const kmp_averaged *averaged, const kempe_system *given);
