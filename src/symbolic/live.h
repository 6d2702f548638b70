/* SPDX-License-Identifier: BSD-3-Clause */
/* The nodes that outputs need. Useless equations (Fisette and Samin 1996, section 3.2) are removed because only these
 * nodes are scheduled. */
#pragma once

#include "symbolic/graph.h"
#include <string.h>

/** Sets mark[id] = value for the nodes of outputs that are not marked yet. mark has kmp_graph_count entries. */
void kmp_live_begin(int count, const kmp_ref *outputs, uint8_t *mark, uint8_t value);

/** Marks every node that marked nodes need, with the least mark of these. */
void kmp_live_spread(const kmp_graph *g, uint8_t *mark);

/** Marks every node that these outputs need with 1. */
void kmp_live_mark(const kmp_graph *g, int count, const kmp_ref *outputs, uint8_t *mark);

/** The last marked node before `id`; UINT32_MAX: there is none. Most nodes of a graph are not marked, and are passed
 * eight at a time. */
static inline uint32_t kmp_live_before(const uint8_t *mark, uint32_t id)
{
    const uint32_t step = 8;
    for (uint64_t eight = 0; id >= step; id -= step) {
        memcpy(&eight, mark + id - step, step);
        if (eight)
            break;
    }
    while (id-- > 0)
        if (mark[id])
            return id;
    return UINT32_MAX;
}
