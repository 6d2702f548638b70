/* SPDX-License-Identifier: BSD-3-Clause */
/* One backward sweep: the order of ids is topological. */
#include "symbolic/program/live.h"

void kmp_live_mark(const kmp_graph *g, int count, const kmp_ref *outputs, uint8_t *mark, uint8_t value)
{
    uint32_t top = 0;
    for (int k = 0; k < count; k++) {
        uint32_t id = kmp_id(outputs[k]);
        if (!mark[id])
            mark[id] = value;
        if (id >= top)
            top = id + 1;
    }
    for (uint32_t id = top; (id = kmp_live_before(mark, id)) != UINT32_MAX;) {
        if (mark[id] != value)
            continue;
        const kmp_node *n = kmp_graph_node(g, id);
        for (int k = kmp_op_arity((kmp_op)n->op); k-- > 0;)
            if (!mark[kmp_id(kmp_operand(n, k))])
                mark[kmp_id(kmp_operand(n, k))] = value;
    }
}
