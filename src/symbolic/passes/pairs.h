/* SPDX-License-Identifier: BSD-3-Clause */
/* Common parts of sums and of products, independent of the order in which they were written. With a + b + c and d + a +
 * c, a + c is made once. */
#ifndef KMP_SYMBOLIC_PAIRS_H
#define KMP_SYMBOLIC_PAIRS_H

#include "symbolic/graph.h"

/** Rewrites the outputs in place where it takes fewer operations; op is ADD or MUL. false: no memory. */
bool kmp_share_pairs(kmp_graph *g, kmp_op op, int count, kmp_ref *outputs);

#endif
