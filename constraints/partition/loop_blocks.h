/* SPDX-License-Identifier: BSD-3-Clause */
/* Loops that are solved one after the other: the diagonal blocks of Jv. */
#pragma once

#include "base/arena.h"
#include "constraints/evaluation/evaluator.h"
#include "constraints/partition/partition.h"

/** One diagonal block of Jv, in order of solution. */
typedef struct kmp_loop_block {
    int size, *columns, *rows;
    int *closures, closure_count;
} kmp_loop_block;

/** Lists the blocks of Jv with their rows and closures in `blocks` (arena); returns their number. -1: no memory or
 * singular. */
int kmp_loop_blocks(kmp_evaluator *eval, const kmp_partition *part, kmp_arena *arena, kmp_loop_block **blocks);
