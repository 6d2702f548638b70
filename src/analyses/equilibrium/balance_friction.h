/* SPDX-License-Identifier: BSD-3-Clause */
/* Dry friction that sticks at an equilibrium. */
#pragma once

#include "analyses/equilibrium/balances.h"
#include "model/data/force.h"

/** The word of an end for people and for tables. */
const char *kmp_rest_text(kmp_rest_word word);

/** Names friction at rest in equilibrium->resting. */
kempe_status kmp_balance_name_resting(kempe_equilibrium *equilibrium, const kmp_linear *linear);

/** Adds friction at the last state of `linear` to a balance there: what its elements need where they stick, and the
 * states of rest that they hold. Warns of friction that takes no part. Changes the state of `linear`. */
kempe_status kmp_balance_add_friction(kempe_equilibrium *equilibrium, kmp_linear *linear, kmp_balance *balance);
