/* SPDX-License-Identifier: BSD-3-Clause */
/* The share of one process of several that work on one ensemble. */
#pragma once

#include "base/context.h"

typedef struct kmp_shard {
    int number, count; /* number: 1 to count */
} kmp_shard;

/** Reads "I/N", or "auto": the variables of the engine that started this process. NULL: one share, all of it.
 * KEMPE_E_ARGUMENT: the word is neither, or no engine's variables are set. */
kempe_status kmp_shard_read(kempe_context *context, const char *word, kmp_shard *shard);
