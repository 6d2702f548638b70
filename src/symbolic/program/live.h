/* SPDX-License-Identifier: BSD-3-Clause */
/* The nodes that outputs need. Useless equations (Fisette and Samin 1996, section 3.2) are removed because only these
 * nodes are scheduled. */
#pragma once

#include "symbolic/graph.h"

/** Sets mark[id] = value for every node that the outputs reach and that is not marked yet; marked nodes are not
 * searched again. mark has kmp_graph_count entries. */
void kmp_live_mark(const kmp_graph *g, int count, const kmp_ref *outputs, uint8_t *mark, uint8_t value);
