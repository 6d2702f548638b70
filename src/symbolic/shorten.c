/* SPDX-License-Identifier: BSD-3-Clause */
/* The list of passes over finished outputs, and the loop through it: trigonometric sums, common factors, common parts
 * of sums and of products. A pass is a row. */
#include "symbolic/shorten.h"
#include "base/memory.h"
#include "symbolic/cost.h"
#include "symbolic/graph.h"
#include "symbolic/label.h"
#include <string.h>

/* -- one pass ---------------------------------------------------------------------------------------- */

/* One pass over a graph: live nodes in their order, rewritten from operands to uses. A result is kept only if it costs
 * less than what it replaces (symbolic/cost.h), so that a pass never makes a program longer. Sums and products are
 * flattened into lists of terms, but for parts that other nodes use too. */

/* Finds the needed nodes of outputs, and the uses of each; the graph may be larger. */
static bool find_demand(kmp_rewrite *r, int count, const kmp_ref *outputs)
{
    uint32_t top = 0, *uses = r->uses = KMP_NEW(uint32_t, kmp_graph_count(r->graph));
    bool ok = uses;
    for (int k = 0; ok && k < count; k++) {
        uint32_t id = kmp_id(outputs[k]);
        uses[id]++;
        top = id >= top ? id + 1 : top;
    }
    for (uint32_t id = ok ? top : 0; id-- > 0 && ok;) {
        if (!uses[id])
            continue;
        const kmp_node *n = kmp_graph_node(r->graph, id);
        ok = kmp_push(&r->live, id);
        for (int k = 0; k < kmp_op_arity((kmp_op)n->op); k++)
            uses[kmp_id(kmp_operand(n, k))]++;
    }
    return ok;
}

/* Room for the rewritten forms of all nodes that the graph has now. */
static bool make_room(kmp_rewrite *r)
{
    r->count = kmp_graph_count(r->graph);
    if (r->count <= r->room)
        return true;
    kmp_free(r->now);
    r->now = kmp_realloc(NULL, r->count, sizeof *r->now);
    r->room = r->now ? r->count : 0;
    return r->now;
}

KMP_CLEARS(kmp_rewrite, r, kmp_free(r->uses), kmp_free(r->now), kmp_free(r->live.id))

bool kmp_rewrite_finish(kmp_rewrite *r, int sum_price, int count, kmp_ref *outputs)
{
    if (kmp_graph_failed(r->graph))
        return false;
    bool same = true;
    for (int k = 0; same && k < count; k++)
        same = kmp_rewritten(r, outputs[k]) == outputs[k];
    if (same)
        return true;
    kmp_rewrite next = {.graph = r->graph};
    kmp_ref *now = KMP_NEW(kmp_ref, count);
    for (int k = 0; now && k < count; k++)
        now[k] = kmp_rewritten(r, outputs[k]);
    bool ok = now && find_demand(&next, count, now);
    if (ok && kmp_cost_of_nodes(r->graph, sum_price, next.live.top, next.live.id) <
                  kmp_cost_of_nodes(r->graph, sum_price, r->live.top, r->live.id)) {
        /* Copies the labels of nodes to their rewritten forms. */
        for (uint32_t k = 0; kmp_graph_has_labels(r->graph) && k < r->live.top; k++) {
            uint32_t id = kmp_rewrite_live(r, k);
            const kmp_label *label = kmp_graph_label_of(r->graph, id);
            if (label)
                kmp_graph_label(r->graph, r->now[id], *label);
        }
        memcpy(outputs, now, (size_t)count * sizeof *now);
        const kmp_rewrite last = *r;
        *r = (kmp_rewrite){.graph = r->graph, .uses = next.uses, .live = next.live, .now = last.now, .room = last.room};
        next = (kmp_rewrite){.uses = last.uses, .live = last.live};
        ok = make_room(r);
    }
    kmp_rewrite_free(&next);
    kmp_free(now);
    return ok;
}

bool kmp_rewrite_alone(kmp_graph *g, kmp_pass_fn *pass, const kmp_parallel *parallel, int count, kmp_ref *outputs)
{
    kmp_rewrite r = {.graph = g};
    bool ok = find_demand(&r, count, outputs) && make_room(&r) && pass(&r, parallel, count, outputs);
    kmp_rewrite_free(&r);
    return ok;
}

/* Appends the operands of x, where there is room, and expands the ones that are inside. `waiting` operands are outside
 * and will need a place each. */
static int flatten(const kmp_rewrite *r, kmp_op op, kmp_ref x, int waiting, kmp_ref *list, int count, kmp_ref *sign)
{
    const kmp_node *n = kmp_graph_node(r->graph, kmp_id(x));
    if (count + waiting + 2 > KMP_MOST_TERMS) {
        list[count] = x;
        return count + 1;
    }
    for (int k = 0; k < 2; k++) {
        kmp_ref y = k == 0 ? n->a : n->b;
        if (op == KMP_OP_MUL)
            *sign ^= y & 1;
        y = op == KMP_OP_MUL ? y & ~(kmp_ref)1 : y ^ (x & 1);
        if (kmp_rewrite_expands(r, op, y))
            count = flatten(r, op, y, waiting + 1 - k, list, count, sign);
        else
            list[count++] = y;
    }
    return count;
}

int kmp_rewrite_flatten(const kmp_rewrite *r, kmp_op op, kmp_ref x, kmp_ref *list, kmp_ref *sign)
{
    if (op == KMP_OP_MUL) {
        *sign ^= x & 1;
        x &= ~(kmp_ref)1;
    }
    if (kmp_graph_node(r->graph, kmp_id(x))->op == op && kmp_id(x) < r->count)
        return flatten(r, op, x, 0, list, 0, sign);
    *list = x;
    return 1;
}

bool kmp_rewrite_sums(kmp_rewrite *r, kmp_rewrite_sum *rewrite, const void *user, int sum_price, int count,
                      kmp_ref *outputs)
{
    for (uint32_t k = 0; k < r->live.top; k++) {
        uint32_t id = kmp_rewrite_live(r, k);
        bool sum = kmp_graph_node(r->graph, id)->op == KMP_OP_ADD;
        r->now[id] = sum ? rewrite(r, user, id) : kmp_rewrite_node(r, id);
    }
    return kmp_rewrite_finish(r, sum_price, count, outputs);
}

/* -- the passes -------------------------------------------------------------------------------------- */

const kmp_pass kmp_passes[KMP_PASSES] = {{"trigonometric", kmp_collapse_trig},
                                         {"common factors", kmp_factor_sums},
                                         {"common parts of sums", kmp_share_sums},
                                         {"common parts of products", kmp_share_products}};

bool kmp_pass_run(const kmp_pass *pass, kmp_graph *g, const kmp_parallel *parallel, int count, kmp_ref *outputs)
{
    return kmp_rewrite_alone(g, pass->run, parallel, count, outputs);
}

static bool run_all(kmp_rewrite *r, const kmp_parallel *parallel, int count, kmp_ref *outputs)
{
    bool ok = true;
    for (int k = 0; ok && k < KMP_PASSES; k++)
        ok = kmp_passes[k].run(r, parallel, count, outputs);
    return ok;
}

bool kmp_shorten(kmp_graph *g, const kmp_parallel *parallel, int count, kmp_ref *outputs)
{
    return kmp_rewrite_alone(g, run_all, parallel, count, outputs);
}
