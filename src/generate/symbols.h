/* SPDX-License-Identifier: BSD-3-Clause */
/* Names of the numbers of a model that are kept as symbols. */
#ifndef KMP_GENERATE_SYMBOLS_H
#define KMP_GENERATE_SYMBOLS_H

#include "model/model.h"

/** The name of symbol k (parameters first, then numbers in the order of reading): a parameter's name, "crank.mass",
 * "coupler.B.x". In the arena; NULL: no memory. */
char *kmp_symbol_name(kmp_arena *arena, const kempe_model *model, int k);

#endif
