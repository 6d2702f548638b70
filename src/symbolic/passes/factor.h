/* SPDX-License-Identifier: BSD-3-Clause */
/* Factors taken out of sums: a b + a c = a (b + c). */
#ifndef KMP_SYMBOLIC_FACTOR_H
#define KMP_SYMBOLIC_FACTOR_H

#include "symbolic/graph.h"

/** Rewrites the outputs in place where it takes fewer operations. Products that other nodes also need are left alone.
 * False: no memory. */
bool kmp_factor_sums(kmp_graph *g, int count, kmp_ref *outputs);

#endif
