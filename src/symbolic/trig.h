/* SPDX-License-Identifier: BSD-3-Clause */
/* Addition theorems: sines and cosines of sums whose parts are needed as well. */
#pragma once

#include "symbolic/graph.h"

/** Sin and cos of a sum whose parts are needed anyway become addition theorems (6 operations instead of a call). A sum
 * with a part that is needed nowhere else keeps its own call. */
bool kmp_trig_sums(kmp_graph *g, int count, kmp_ref *outputs);
/** kmp_trig_sums of outputs whose needed nodes are marked (not 0) in `live`, of the graph's first `nodes`, which are
 * all. Of each angle both functions are nodes then. *changed is set if the outputs are others. */
bool kmp_trig_sums_of(kmp_graph *g, uint32_t nodes, const uint8_t *live, int count, kmp_ref *outputs, bool *changed);
