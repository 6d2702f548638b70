/* SPDX-License-Identifier: BSD-3-Clause */
/* The nodes that x needs are marked from x down and rebuilt from the inputs up: the order of ids is topological. */
#include "base/memory.h"
#include "symbolic/graph.h"

static kmp_ref signed_like(kmp_ref r, kmp_ref sign)
{
    return kmp_is_negative(sign) ? kmp_neg(r) : r;
}

static void mark(const kmp_graph *g, uint32_t top, bool *needed)
{
    needed[top] = true;
    for (uint32_t id = top + 1; id-- > 0;) {
        const kmp_node *n = kmp_graph_node(g, id);
        for (int k = 0; needed[id] && k < kmp_op_arity((kmp_op)n->op); k++)
            needed[kmp_id(kmp_operand(n, k))] = true;
    }
}

static kmp_ref rebuild(kmp_graph *g, uint32_t id, const kmp_ref *made)
{
    const kmp_node n = *kmp_graph_node(g, id);
    kmp_ref operands[3] = {0};
    bool same = true;
    for (int k = 0; k < kmp_op_arity((kmp_op)n.op); k++) {
        kmp_ref old = kmp_operand(&n, k);
        operands[k] = signed_like(made[kmp_id(old)], old);
        same = same && operands[k] == old;
    }
    return same ? id << 1 : kmp_graph_rebuild(g, id, operands);
}

kmp_ref kmp_graph_replace(kmp_graph *g, int count, const kmp_ref *input, const kmp_ref *by, kmp_ref x)
{
    uint32_t top = kmp_id(x);
    bool *needed = KMP_NEW(bool, top + 1);
    kmp_ref *made = KMP_NEW(kmp_ref, top + 1), r = KMP_ZERO;
    if (needed && made) {
        mark(g, top, needed);
        for (uint32_t id = 0; id <= top; id++) {
            made[id] = id << 1;
            for (int k = 0; k < count; k++)
                if (kmp_id(input[k]) == id)
                    made[id] = signed_like(by[k], input[k]);
            if (needed[id] && made[id] == id << 1)
                made[id] = rebuild(g, id, made);
        }
        r = signed_like(made[top], x);
    } else {
        kmp_graph_fail(g);
    }
    kmp_free(needed);
    kmp_free(made);
    return r;
}
