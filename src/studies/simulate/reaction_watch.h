/* SPDX-License-Identifier: BSD-3-Clause */
/* The largest reactions of all joints, and the loads of bearings, in the whole motion of a run: each accepted step is
 * looked at between its ends, as the quantities of instances are (output/quantities). */
#pragma once

#include "integrators/run/run.h"
#include "output/bearing_loads.h"

typedef struct kmp_reaction_watch kmp_reaction_watch;

/** `rtol`: the error of values between samples over their largest size. KEMPE_E_MEMORY. */
kempe_status kmp_reaction_watch_new(const kempe_system *system, double rtol, bool least_norm,
                                    kmp_reaction_watch **watch);
void kmp_reaction_watch_free(kmp_reaction_watch *watch);

/** Takes the last accepted step of a run, from one time to another. false: the runner has the reason. */
bool kmp_reaction_watch_step(kmp_reaction_watch *watch, kmp_runner *runner, double from, double to);

/** The largest ones so far; not `whole` before the first step. */
const kmp_reactions *kmp_reaction_watch_found(const kmp_reaction_watch *watch);

/** The loads of the bearings of the model so far. */
const kmp_bearing_loads *kmp_reaction_watch_bearings(const kmp_reaction_watch *watch);
