/* SPDX-License-Identifier: BSD-3-Clause */
/* Transfer functions (b_0 s^n + b_1 s^(n-1) + .. + b_n) / (a_0 s^n + a_1 s^(n-1) + .. + a_n) u as states, in the
 * observable canonical form (Kailath 1980, section 2.1). */
#pragma once

#include "model/read/function_block.h"

/** The kinds with files of their own. */
extern const kmp_block_kind kmp_block_transfer;
