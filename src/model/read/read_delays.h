/* SPDX-License-Identifier: BSD-3-Clause */
/* Delays. One by samples is a chain of sampled states. */
#pragma once

#include "model/read/function_block.h"

extern const kmp_block_kind kmp_block_delay;
