/* SPDX-License-Identifier: BSD-3-Clause */
/* Operations of implicit blocks in one right-hand side, which depend on the state. */
#pragma once

#include "backend/x86/machine.h"
#include "dynamics/system.h"

/** Those at the model's start; all zero without blocks. KEMPE_E_MEMORY, or the error of the assembly. */
kempe_status kmp_block_counts_at_start(const kempe_system *system, kmp_block_counts *counts);
