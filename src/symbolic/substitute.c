/* SPDX-License-Identifier: BSD-3-Clause */
/* Depth first with an explicit stack, so that a small change in a large graph costs the nodes that it touches. */
#include "symbolic/substitute.h"
#include "symbolic/function_table.h"
#include "symbolic/stack.h"

/* A visited node and its replacement. */
typedef struct entry {
    uint32_t key; /* of the node, + 1; 0: free */
    kmp_ref now;
} entry;

typedef struct rewriting {
    kmp_graph *g;
    entry *entry; /* open addressing */
    uint32_t size, count;
    kmp_stack stack;
    bool failed;
} rewriting;

static entry *entry_of(const rewriting *w, uint32_t id)
{
    uint32_t k = id * 0x9e3779b1u;
    for (k = (k ^ k >> 15) & (w->size - 1); w->entry[k].key && w->entry[k].key != id + 1; k = (k + 1) & (w->size - 1))
        ;
    return &w->entry[k];
}

static bool grow(rewriting *w)
{
    const rewriting old = *w;
    w->size = old.size ? 2 * old.size : 64;
    w->entry = KMP_NEW(entry, w->size);
    for (uint32_t k = 0; w->entry && k < old.size; k++)
        if (old.entry[k].key)
            *entry_of(w, old.entry[k].key - 1) = old.entry[k];
    w->size = w->entry ? w->size : 0;
    kmp_free(old.entry);
    return w->entry;
}

static void set(rewriting *w, uint32_t id, kmp_ref now)
{
    if (2 * (w->count + 1) > w->size && !grow(w)) {
        w->failed = true;
        return;
    }
    entry *e = entry_of(w, id);
    w->count += e->key == 0;
    *e = (entry){id + 1, now};
}

static bool known(const rewriting *w, uint32_t id)
{
    return w->size && entry_of(w, id)->key;
}

static kmp_ref now(const rewriting *w, kmp_ref r)
{
    kmp_ref n = entry_of(w, kmp_id(r))->now;
    return kmp_is_negative(r) ? kmp_neg(n) : n;
}

static kmp_ref rewrite(rewriting *w, kmp_ref output, uint16_t *through)
{
    for (w->failed = !kmp_push(&w->stack, kmp_id(output)) || w->failed; w->stack.top && !w->failed;) {
        uint32_t id = w->stack.id[w->stack.top - 1], before = w->stack.top;
        kmp_node n = *kmp_graph_node(w->g, id);
        int arity = kmp_op_arity((kmp_op)n.op);
        for (int k = 0; !known(w, id) && k < arity; k++)
            if (!known(w, kmp_id(kmp_operand(&n, k))))
                w->failed = !kmp_push(&w->stack, kmp_id(kmp_operand(&n, k))) || w->failed;
        if (w->stack.top > before)
            continue;
        w->stack.top--;
        if (known(w, id))
            continue;
        kmp_ref operands[3] = {0}, result = id << 1;
        for (int k = 0; k < arity; k++)
            operands[k] = now(w, kmp_operand(&n, k));
        if (arity > 0)
            result = kmp_graph_rebuild(w->g, w->g, id, operands);
        else
            *through |= n.depends;
        set(w, id, result);
    }
    return w->failed ? KMP_ZERO : now(w, output);
}

bool kmp_substitute(kmp_graph *g, int count, const kmp_ref *from, const kmp_ref *to, int output_count, kmp_ref *outputs,
                    uint16_t *through)
{
    rewriting w = {.g = g};
    *through = 0;
    for (int k = 0; k < count; k++)
        set(&w, kmp_id(from[k]), kmp_is_negative(from[k]) ? kmp_neg(to[k]) : to[k]);
    for (int k = 0; k < output_count && !w.failed; k++)
        outputs[k] = rewrite(&w, outputs[k], through);
    kmp_free(w.entry);
    kmp_free(w.stack.id);
    return !w.failed && !kmp_graph_failed(g);
}

/* Marks the nodes of x that depend on an input of these kinds; *least is the first of them. */
static bool mark_moved(const kmp_graph *g, kmp_ref x, unsigned depends, uint8_t *moved, uint32_t *least)
{
    kmp_stack stack = {0};
    bool ok = !(kmp_graph_node(g, kmp_id(x))->depends & depends) || kmp_push(&stack, kmp_id(x));
    while (ok && stack.top) {
        uint32_t id = stack.id[--stack.top];
        const kmp_node *n = kmp_graph_node(g, id);
        if (moved[id])
            continue;
        moved[id] = 1;
        *least = id < *least ? id : *least;
        for (int k = 0; k < kmp_op_arity((kmp_op)n->op); k++)
            if (kmp_graph_node(g, kmp_id(kmp_operand(n, k)))->depends & depends)
                ok = ok && kmp_push(&stack, kmp_id(kmp_operand(n, k)));
    }
    kmp_free(stack.id);
    return ok;
}

/* Nodes that move are rebuilt from the inputs up: the order of ids is topological. */
static kmp_ref rebuild(kmp_graph *g, int count, const kmp_ref *input, const kmp_ref *by, kmp_ref x, uint32_t least,
                       const uint8_t *moved, kmp_ref *made)
{
    for (uint32_t id = least; id <= kmp_id(x); id++) {
        const kmp_node *n = kmp_graph_node(g, id);
        for (int k = 0; moved[id] && k < kmp_op_arity((kmp_op)n->op); k++)
            if (!moved[kmp_id(kmp_operand(n, k))])
                made[kmp_id(kmp_operand(n, k))] = kmp_operand(n, k) & ~(kmp_ref)1;
        if (moved[id])
            made[id] = id << 1;
        for (int k = 0; k < count && moved[id]; k++)
            if (kmp_id(input[k]) == id)
                made[id] = kmp_is_negative(input[k]) ? kmp_neg(by[k]) : by[k];
        if (moved[id] && made[id] == id << 1)
            made[id] = kmp_graph_rebuild_by(g, g, id, made);
    }
    return kmp_mapped(made, x);
}

kmp_ref kmp_graph_replace(kmp_graph *g, int count, const kmp_ref *input, const kmp_ref *by, kmp_ref x)
{
    uint32_t top = kmp_id(x), least = UINT32_MAX;
    unsigned depends = 0;
    for (int k = 0; k < count; k++)
        depends |= kmp_graph_node(g, kmp_id(input[k]))->depends;
    uint8_t *moved = KMP_NEW(uint8_t, top + 1);
    kmp_ref *made = kmp_realloc(NULL, top + 1, sizeof *made); /* of the nodes that move, and of their operands */
    kmp_ref now = x;
    if (!moved || !made || !mark_moved(g, x, depends, moved, &least))
        kmp_graph_fail(g);
    else if (least <= top)
        now = rebuild(g, count, input, by, x, least, moved, made);
    kmp_free(moved);
    kmp_free(made);
    return kmp_graph_failed(g) ? KMP_ZERO : now;
}
