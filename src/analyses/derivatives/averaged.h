/* SPDX-License-Identifier: BSD-3-Clause */
/* A system in place of one with sampled states, for studies of small motions: each sampled state y has the rate
 * (next - y)/T, T being the time between its samples. Its equilibria are the equilibria of the samples, where y is
 * `next`, and its linear equations contain the equations of the samples (analyses/derivatives/sampled_motion.h). A
 * delayed signal u has the rate (u - y)/T (analyses/derivatives/delayed_spectrum.h). A state that changes at events
 * keeps its start value y0 by the rate y0 - y, on which nothing but itself depends. Tracks are without their
 * irregularities: on these a vehicle has neither a steady motion nor a place of rest near its start. */
#pragma once

#include "analyses/derivatives/linearized.h"
#include "base/text.h"
#include "model/data/force.h"

typedef struct kmp_averaged kmp_averaged;

/** *averaged: NULL for a model without such states and irregularities; a warning names these. */
kempe_status kmp_averaged_new(const kempe_system *given, kmp_averaged **averaged);

/** At a state of the linear equations of its system, or of a variant of it. KEMPE_E_FAILED: a state that changes at
 * events does so there, within small motions, or has not the value that its input requires. */
kempe_status kmp_averaged_judge(const kmp_averaged *averaged, const kmp_linear *linear);

/** A line, after `label`, that says that irregularities of tracks are left out; nothing where there are none. */
void kmp_averaged_put(kmp_text *text, const char *label, const kmp_averaged *averaged);
void kmp_averaged_free(kmp_averaged *averaged);

/** Its system, which has the model's names and its user's force; `given` where there is none. */
const kempe_system *kmp_averaged_system(const kmp_averaged *averaged, const kempe_system *given);
