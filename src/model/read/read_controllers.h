/* SPDX-License-Identifier: BSD-3-Clause */
/* Controllers with proportional, integral and derivative parts. */
#pragma once

#include "model/read/function_block.h"

extern const kmp_block_kind kmp_block_pid;
