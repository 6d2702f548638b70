/* SPDX-License-Identifier: BSD-3-Clause */
#include "analyses/equilibrium/equilibrium_start.h"
#include "base/wings.h"

const kmp_wing kmp_wing_analyses = {.name = "analyses", .balance = kmp_start_to_equilibrium};
