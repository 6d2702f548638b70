/* SPDX-License-Identifier: BSD-3-Clause */
#include "symbolic/enclose.h"
#include "symbolic/implicit.h"
#include "symbolic/program/live.h"

enum { FIRST = 8 }; /* KMP_IN_PLACE before it are x, y, z */

typedef struct enclosing {
    kmp_graph *g, *local;
    kmp_ref *map;       /* by node: its reference inside the block */
    bool *has;          /* by node: it is there */
    kmp_ref *arguments; /* outside */
    int argument_count;
} enclosing;

kmp_ref kmp_unknown(kmp_graph *g, int j)
{
    return kmp_input(g, KMP_IN_PLACE, (uint32_t)(FIRST + j));
}

static bool moves(const kmp_graph *g, uint32_t id)
{
    return kmp_graph_node(g, id)->depends & 1u << KMP_IN_PLACE;
}

/* A number, an unknown or an argument. */
static kmp_ref leaf(enclosing *e, uint32_t id)
{
    const kmp_node *n = kmp_graph_node(e->g, id);
    if (n->op == KMP_OP_CONST)
        return kmp_const(e->local, kmp_graph_value(e->g, id));
    if (moves(e->g, id))
        return kmp_input(e->local, KMP_IN_Q, n->b - FIRST);
    e->arguments[e->argument_count] = id << 1;
    return kmp_input(e->local, KMP_IN_PARAMETER, (uint32_t)e->argument_count++);
}

static kmp_ref inside(enclosing *e, kmp_ref r)
{
    uint32_t id = kmp_id(r);
    if (!e->has[id])
        e->map[id] = leaf(e, id);
    e->has[id] = true;
    return kmp_mapped(e->map, r);
}

/* All that moves, in order, so that operands are there before. */
static void bring(enclosing *e, int count, const kmp_ref *residual)
{
    uint32_t nodes = kmp_graph_count(e->g);
    uint8_t *live = KMP_GRAPH_NEW(e->g, uint8_t, nodes);
    if (live)
        kmp_live_mark(e->g, count, residual, live);
    for (uint32_t id = 0; live && id < nodes; id++)
        if (live[id] && moves(e->g, id) && kmp_op_form_of((kmp_op)kmp_graph_node(e->g, id)->op) != KMP_FORM_LEAF) {
            const kmp_node *n = kmp_graph_node(e->g, id);
            kmp_ref x[3] = {0};
            for (int k = 0; k < kmp_op_arity((kmp_op)n->op); k++)
                x[k] = inside(e, kmp_operand(n, k));
            e->map[id] = kmp_graph_rebuild(e->local, e->g, id, x);
            e->has[id] = true;
        }
}

void kmp_enclose(kmp_graph *g, int unknowns, const kmp_ref *residual, const kmp_ref *guess, kmp_ref *solution)
{
    uint32_t nodes = kmp_graph_count(g);
    kmp_ref r[KMP_IMPLICIT_MOST], first[KMP_IMPLICIT_MOST];
    enclosing e = {.g = g, .local = kmp_graph_new()};
    e.map = KMP_GRAPH_NEW(g, kmp_ref, nodes);
    e.has = KMP_GRAPH_NEW(g, bool, nodes);
    e.arguments = KMP_GRAPH_NEW(g, kmp_ref, nodes);
    for (int j = 0; j < unknowns; j++)
        solution[j] = KMP_ZERO;
    if (!e.local || kmp_graph_failed(g)) {
        kmp_graph_free(e.local);
        kmp_graph_fail(g);
        return;
    }
    bring(&e, unknowns, residual);
    for (int j = 0; j < unknowns; j++) {
        r[j] = inside(&e, residual[j]);
        first[j] = inside(&e, guess[j]);
    }
    kmp_implicit *block = kmp_implicit_new(e.local, unknowns, e.argument_count, r, first);
    kmp_implicit_at(g, kmp_graph_add_implicit(g, block), e.arguments, solution);
}
