/* SPDX-License-Identifier: BSD-3-Clause */
/* What the numbers of a model are called where they are kept as symbols. */
#ifndef KMP_GENERATE_SYMBOLS_H
#define KMP_GENERATE_SYMBOLS_H

#include "model/model.h"

/** Of symbol k (parameters first, then numbers as they were read): a parameter's name, "crank.mass", "coupler.B.x".
 *  To be freed; NULL: no memory. */
char *kmp_symbol_name(const kempe_model *model, int k);

#endif
