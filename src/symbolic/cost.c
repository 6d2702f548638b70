/* SPDX-License-Identifier: BSD-3-Clause */
/* Reference counts: a node costs while it is in use, and uses its operands as long. */
#include "symbolic/cost.h"
#include "base/memory.h"
#include "symbolic/live.h"

/* Room for the nodes that the graph has by now. */
static bool reserve(kmp_cost *cost)
{
    uint32_t nodes = kmp_graph_count(cost->graph);
    if (nodes <= cost->nodes)
        return true;
    uint32_t room = nodes + nodes / 2;
    uint32_t *uses = kmp_realloc(cost->uses, room, sizeof *uses);
    if (!uses) {
        cost->failed = true;
        return false;
    }
    for (uint32_t id = cost->nodes; id < room; id++)
        uses[id] = 0;
    cost->uses = uses;
    cost->nodes = room;
    return true;
}

bool kmp_cost_init(kmp_cost *cost, const kmp_graph *g, int sum_price)
{
    *cost = (kmp_cost){.graph = g, .sum_price = sum_price};
    return reserve(cost);
}

KMP_CLEARS(kmp_cost, cost, kmp_free(cost->uses), kmp_free(cost->stack.id))

static inline long price(const kmp_graph *g, int sum_price, const kmp_node *n)
{
    if (n->op == KMP_OP_ADD || n->op == KMP_OP_MUL) /* most nodes */
        return 1;
    switch ((kmp_op)n->op) {
    case KMP_OP_DIV:
        return 1;
    case KMP_OP_SIN:
    case KMP_OP_COS:
        return kmp_graph_node(g, kmp_id(n->a))->op == KMP_OP_ADD ? sum_price : 0;
    default:
        return 0;
    }
}

/* Counts one use of r up or down, and the uses of its operands when r comes into use or goes out of it. */
static void count_use(kmp_cost *cost, kmp_ref r, bool up)
{
    if (!reserve(cost))
        return;
    cost->failed = !kmp_push(&cost->stack, kmp_id(r)) || cost->failed;
    while (cost->stack.top) {
        uint32_t id = cost->stack.id[--cost->stack.top];
        bool turns = up ? cost->uses[id]++ == 0 : --cost->uses[id] == 0;
        if (!turns)
            continue;
        const kmp_node *n = kmp_graph_node(cost->graph, id);
        long own = price(cost->graph, cost->sum_price, n);
        long paid = up ? own : -own;
        cost->operations += paid;
        cost->once += n->depends & ~(1u << KMP_IN_PARAMETER) ? 0 : paid;
        for (int k = 0; k < kmp_op_arity((kmp_op)n->op); k++)
            cost->failed = !kmp_push(&cost->stack, kmp_id(kmp_operand(n, k))) || cost->failed;
    }
}

void kmp_cost_add(kmp_cost *cost, int count, const kmp_ref *outputs)
{
    for (int k = 0; k < count && !cost->failed; k++)
        count_use(cost, outputs[k], true);
}

void kmp_cost_remove(kmp_cost *cost, int count, const kmp_ref *outputs)
{
    for (int k = 0; k < count && !cost->failed; k++)
        count_use(cost, outputs[k], false);
}

long kmp_cost_of_nodes(const kmp_graph *g, int sum_price, uint32_t count, const uint32_t *ids)
{
    long operations = 0;
    for (uint32_t k = 0; k < count; k++)
        operations += price(g, sum_price, kmp_graph_node(g, ids[k]));
    return operations;
}

bool kmp_cost_total(kmp_cost *cost, int count, const kmp_ref *outputs)
{
    const kmp_graph *g = cost->graph;
    uint32_t id = kmp_graph_count(g);
    uint8_t *live = KMP_NEW(uint8_t, id);
    if (!live)
        return false;
    kmp_live_mark(g, count, outputs, live);
    while ((id = kmp_live_before(live, id)) != UINT32_MAX) {
        const kmp_node *n = kmp_graph_node(g, id);
        long own = price(g, cost->sum_price, n);
        cost->operations += own;
        cost->once += n->depends & ~(1u << KMP_IN_PARAMETER) ? 0 : own;
    }
    kmp_free(live);
    return true;
}
