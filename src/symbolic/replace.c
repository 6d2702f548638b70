/* SPDX-License-Identifier: BSD-3-Clause */
/* The nodes that x needs are marked from x down and rebuilt from the inputs up: the order of ids is topological. */
#include "symbolic/program/live.h"

kmp_ref kmp_graph_replace(kmp_graph *g, int count, const kmp_ref *input, const kmp_ref *by, kmp_ref x)
{
    uint32_t top = kmp_id(x);
    uint8_t *needed = KMP_GRAPH_NEW(g, uint8_t, kmp_graph_count(g));
    kmp_ref *made = KMP_GRAPH_NEW(g, kmp_ref, top + 1);
    if (!needed || !made)
        return KMP_ZERO;
    kmp_live_mark(g, 1, &x, needed, 1);
    for (uint32_t id = 0; id <= top; id++) {
        made[id] = id << 1;
        for (int k = 0; k < count; k++)
            if (kmp_id(input[k]) == id)
                made[id] = kmp_is_negative(input[k]) ? kmp_neg(by[k]) : by[k];
        if (needed[id] && made[id] == id << 1)
            made[id] = kmp_graph_rebuild_by(g, g, id, made);
    }
    return kmp_mapped(made, x);
}
