/* SPDX-License-Identifier: BSD-3-Clause */
#include "symbolic/passes/rewrite.h"
#include "symbolic/label.h"
#include "symbolic/program/cost.h"
#include <string.h>

bool kmp_rewrite_init(kmp_rewrite *r, kmp_graph *g, int count, const kmp_ref *outputs)
{
    uint32_t nodes = kmp_graph_count(g), top = 0;
    *r = (kmp_rewrite){.graph = g, .count = nodes};
    r->uses = KMP_ARENA_NEW(&r->room, uint32_t, nodes);
    r->now = KMP_ARENA_NEW(&r->room, kmp_ref, nodes);
    if (r->room.failed) {
        kmp_rewrite_free(r);
        return false;
    }
    for (int k = 0; k < count; k++) {
        uint32_t id = kmp_id(outputs[k]);
        r->uses[id]++;
        top = id >= top ? id + 1 : top;
    }
    bool ok = true;
    for (uint32_t id = top; id-- > 0 && ok;) {
        if (!r->uses[id])
            continue;
        const kmp_node *n = kmp_graph_node(g, id);
        ok = kmp_push(&r->live, id);
        for (int k = 0; k < kmp_op_arity((kmp_op)n->op); k++)
            r->uses[kmp_id(kmp_operand(n, k))]++;
    }
    if (!ok)
        kmp_rewrite_free(r);
    return ok;
}

void kmp_rewrite_free(kmp_rewrite *r)
{
    kmp_free(r->live.id);
    kmp_arena_free(&r->room);
}

kmp_ref kmp_rewrite_node(const kmp_rewrite *r, uint32_t id)
{
    return kmp_graph_rebuild_by(r->graph, r->graph, id, r->now);
}

/* Copies the labels of nodes to their rewritten forms. */
static void carry_labels(const kmp_rewrite *r)
{
    for (uint32_t k = 0; kmp_graph_has_labels(r->graph) && k < r->live.top; k++) {
        uint32_t id = kmp_rewrite_live(r, k);
        const kmp_label *label = kmp_graph_label_of(r->graph, id);
        if (label)
            kmp_graph_label(r->graph, r->now[id], *label);
    }
}

bool kmp_rewrite_finish(kmp_rewrite *r, int sum_price, int count, kmp_ref *outputs)
{
    kmp_ref *now = KMP_ARENA_NEW(&r->room, kmp_ref, count);
    if (!now || kmp_graph_failed(r->graph))
        return false;
    for (int k = 0; k < count; k++)
        now[k] = kmp_rewritten(r, outputs[k]);
    long before = kmp_cost_of_nodes(r->graph, sum_price, r->live.top, r->live.id);
    long after = kmp_cost_of(r->graph, sum_price, count, now);
    if (after >= 0 && after < before) {
        carry_labels(r);
        memcpy(outputs, now, (size_t)count * sizeof *now);
    }
    return after >= 0;
}

/* Appends operands to the list. `waiting` operands are outside and will need a place each. */
static int flatten(const kmp_rewrite *r, kmp_op op, kmp_ref x, bool top, int waiting, kmp_ref *list, int count,
                   kmp_ref *sign)
{
    const kmp_node *n = kmp_graph_node(r->graph, kmp_id(x));
    if (op == KMP_OP_MUL) {
        *sign ^= x & 1;
        x &= ~(kmp_ref)1;
    }
    bool inside = kmp_id(x) < r->count && (top || r->uses[kmp_id(x)] == 1) && n->op == op;
    if (!inside || count + waiting + 2 > KMP_MOST_TERMS) {
        list[count] = x;
        return count + 1;
    }
    count = flatten(r, op, n->a ^ (x & 1), false, waiting + 1, list, count, sign);
    return flatten(r, op, n->b ^ (x & 1), false, waiting, list, count, sign);
}

int kmp_rewrite_flatten(const kmp_rewrite *r, kmp_op op, kmp_ref x, kmp_ref *list, kmp_ref *sign)
{
    return flatten(r, op, x, true, 0, list, 0, sign);
}

bool kmp_rewrite_sums(kmp_graph *g, kmp_rewrite_sum *rewrite, const void *user, int sum_price, int count,
                      kmp_ref *outputs)
{
    kmp_rewrite r;
    if (!kmp_rewrite_init(&r, g, count, outputs))
        return false;
    for (uint32_t k = 0; k < r.live.top; k++) {
        uint32_t id = kmp_rewrite_live(&r, k);
        r.now[id] = kmp_graph_node(g, id)->op == KMP_OP_ADD ? rewrite(&r, user, id) : kmp_rewrite_node(&r, id);
    }
    bool ok = kmp_rewrite_finish(&r, sum_price, count, outputs);
    kmp_rewrite_free(&r);
    return ok;
}
