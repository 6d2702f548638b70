/* SPDX-License-Identifier: BSD-3-Clause */
/* Motions that begin at an equilibrium. */
#pragma once

#include "constraints/closing/assemble.h"

/** Moves a closed start to the equilibrium that its model asks for (base/wings.h). */
kempe_status kmp_start_to_equilibrium(const kempe_system *system, kempe_assembly *assembly);
