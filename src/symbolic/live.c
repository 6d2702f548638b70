/* SPDX-License-Identifier: BSD-3-Clause */
/* One backward sweep for all outputs: the order of ids is topological. */
#include "symbolic/live.h"

void kmp_live_begin(int count, const kmp_ref *outputs, uint8_t *mark, uint8_t value)
{
    for (int k = 0; k < count; k++)
        if (!mark[kmp_id(outputs[k])])
            mark[kmp_id(outputs[k])] = value;
}

void kmp_live_spread(const kmp_graph *g, uint8_t *mark)
{
    for (uint32_t id = kmp_graph_count(g); (id = kmp_live_before(mark, id)) != UINT32_MAX;) {
        const kmp_node *n = kmp_graph_node(g, id);
        const uint8_t value = mark[id];
        for (int k = kmp_op_arity((kmp_op)n->op); k-- > 0;) {
            uint8_t *operand = &mark[kmp_id(kmp_operand(n, k))];
            if (!*operand || *operand > value)
                *operand = value;
        }
    }
}

void kmp_live_mark(const kmp_graph *g, int count, const kmp_ref *outputs, uint8_t *mark)
{
    kmp_live_begin(count, outputs, mark, 1);
    kmp_live_spread(g, mark);
}
