/* SPDX-License-Identifier: BSD-3-Clause */
/* The names of symbols: of all numbers of a model, that with the symbol gives the name. */
#pragma once

#include "base/arena.h"
#include <kempe/kempe.h>

/** The name of symbol k (parameters first, then numbers in the order of reading): a parameter's name, "crank.mass",
 * "coupler.B.x". In the arena; NULL: no memory. */
char *kmp_symbol_name(kmp_arena *arena, const kempe_model *model, int k);
