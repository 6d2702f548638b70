/* SPDX-License-Identifier: BSD-3-Clause */
/* The bifurcation diagram: amplitudes over the parameter, a plot for each output. Stable parts are solid, all others
 * dashed; an equilibrium has no amplitude. */
#pragma once

#include "analyses/limit_cycles/cycle_branch.h"

/** A piece between two cycles is stable where both are, or one and a fold or a Hopf point at its end. */
bool kmp_cycles_stable_between(const kmp_cycle *a, const kmp_cycle *b);
