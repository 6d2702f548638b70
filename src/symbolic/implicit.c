/* SPDX-License-Identifier: BSD-3-Clause */
/* Blocks in the graph, whose local equations are derived once. A derivative brings them into the enclosing graph with
 * the unknowns and arguments inserted. It solves the linear system for one or two unknowns by quotients, for more by a
 * linear block. Arguments are a chain of LIST nodes. */
#include "symbolic/implicit.h"
#include "base/arena.h"
#include "base/memory.h"
#include "base/quantile.h"
#include "base/wings.h"
#include "symbolic/blocks.h"
#include "symbolic/derivative.h"
#include "symbolic/function_table.h"
#include "symbolic/graph.h"
#include "symbolic/live.h"
#include "symbolic/ops.h"
#include <string.h>

enum { MOST = KMP_IMPLICIT_MOST };

/* -- construction ------------------------------------------------------------------------------------ */

/* Stages: 1 the guess, then the merit of candidates, then residuals and derivatives. */
static bool make_program(kmp_implicit *b, const kmp_ref *residual, const kmp_ref *first, kmp_ref merit)
{
    bool among = b->block.candidates > 0;
    int n = b->block.unknowns, count[3] = {n, 1, n + n * n + (among && n == 1)};
    kmp_ref equations[MOST + MOST * MOST], guess[MOST];
    for (int i = 0; i < n; i++) {
        equations[i] = residual[i];
        guess[i] = among && i == 0 ? KMP_ZERO : first[i];
    }
    for (int i = 0; i < n * n; i++)
        equations[n + i] = b->slope[i];
    if (among && n == 1)
        kmp_derivatives_by(b->local, kmp_input(b->local, KMP_IN_Q, 0), 1, &merit, &equations[2]);
    const kmp_ref *groups[3] = {guess, &merit, equations};
    if (!among) {
        count[1] = count[2];
        groups[1] = equations;
    }
    if (!kmp_graph_failed(b->local))
        b->block.program = kmp_program_new(b->local, among ? 3 : 2, count, groups);
    return b->block.program;
}

bool kmp_block_candidates(kmp_implicit *b, int count, const double *candidate)
{
    double *to = KMP_GRAPH_NEW(b->local, double, count);
    b->block.candidates = count;
    b->block.candidate = to;
    if (to && count > 0) {
        memcpy(to, candidate, (size_t)count * sizeof *to);
        kmp_order(count, to);
    }
    return to;
}

kmp_implicit *kmp_implicit_new(kmp_graph *local, int unknowns, int arguments, const kmp_ref *residual,
                               const kmp_ref *guess)
{
    return kmp_implicit_new_among(local, unknowns, arguments, residual, guess, 0, NULL, KMP_ZERO);
}

kmp_implicit *kmp_implicit_new_among(kmp_graph *local, int unknowns, int arguments, const kmp_ref *residual,
                                     const kmp_ref *guess, int candidates, const double *candidate, kmp_ref merit)
{
    kmp_implicit *b = KMP_NEW(kmp_implicit, 1);
    if (!b) {
        kmp_graph_free(local);
        return NULL;
    }
    b->local = local;
    b->block.unknowns = unknowns;
    b->block.arguments = arguments;
    bool plain = unknowns >= 1 && unknowns <= MOST && !kmp_graph_implicit(local, 0);
    if (plain && kmp_block_candidates(b, candidates, candidate)) {
        int n = b->block.unknowns;
        kmp_ref column[MOST];
        for (int j = 0; j < n; j++) {
            kmp_derivatives_by(b->local, kmp_input(b->local, KMP_IN_Q, (uint32_t)j), n, residual, column);
            for (int i = 0; i < n; i++)
                b->slope[i * n + j] = column[i];
        }
        int count = b->block.arguments;
        kmp_ref *p = KMP_GRAPH_NEW(b->local, kmp_ref, 2 * count);
        for (int l = 0; p && l < count; l++) {
            p[l] = kmp_input(b->local, KMP_IN_PARAMETER, (uint32_t)l);
            p[count + l] = kmp_input(b->local, KMP_IN_LAMBDA, (uint32_t)l);
        }
        kmp_derivative *d = p ? kmp_derivative_new(b->local, count, p, p + count) : NULL;
        for (int i = 0; i < b->block.unknowns; i++)
            b->change[i] = kmp_derivative_of(d, residual[i]);
        kmp_derivative_free(d);
        if (make_program(b, residual, guess, merit))
            return b;
    }
    kmp_implicit_free(b);
    return NULL;
}

void kmp_implicit_free(kmp_implicit *b)
{
    if (!b)
        return;
    kmp_program_free(b->block.program);
    kmp_graph_free(b->local);
    kmp_free(b);
}

bool kmp_implicit_equal(const kmp_implicit *a, const kmp_implicit *b)
{
    const kmp_program_block *x = &a->block, *y = &b->block;
    return x->unknowns == y->unknowns && x->arguments == y->arguments && x->linear == y->linear &&
           x->averages == y->averages && x->candidates == y->candidates &&
           memcmp(x->candidate, y->candidate, (size_t)x->candidates * sizeof *x->candidate) == 0 &&
           kmp_program_equal(x->program, y->program);
}

const kmp_places_wing *kmp_places_of_build(void)
{
    const kmp_wing *const *wing = kmp_wings;
    while (*wing && !(*wing)->places)
        wing++;
    return *wing ? (*wing)->places : NULL;
}

const kmp_program_block *kmp_implicit_block(const kmp_implicit *b)
{
    return &b->block;
}

int kmp_graph_add_block(kmp_graph *g, const kmp_program_block *block)
{
    kmp_implicit *b = KMP_NEW(kmp_implicit, 1);
    if (b) {
        b->block = *block;
        b->local = kmp_graph_new();
        b->block.program = kmp_program_copy(block->program);
    }
    bool made = b && b->local && b->block.program && kmp_block_candidates(b, block->candidates, block->candidate);
    if (!made && b)
        kmp_implicit_free(b);
    return kmp_graph_add_implicit(g, made ? b : NULL);
}

/* -- in the graph ------------------------------------------------------------------------------------ */

void kmp_list_items(const kmp_graph *g, kmp_ref list, int count, kmp_ref *items)
{
    for (int l = 0; l < count; l++) {
        const kmp_node *n = kmp_graph_node(g, kmp_id(list));
        bool more = n->op == KMP_OP_LIST;
        items[l] = more ? n->a : KMP_ZERO;
        list = more ? n->b : KMP_ZERO;
    }
}

kmp_ref kmp_implicit_component(kmp_graph *g, int block, int component, kmp_ref list)
{
    return kmp_graph_intern(
        g, (kmp_node){.op = KMP_OP_IMPLICIT, .a = list, .b = (uint32_t)block, .c = (uint32_t)component});
}

void kmp_implicit_at(kmp_graph *g, int block, const kmp_ref *arguments, kmp_ref *unknowns)
{
    const kmp_implicit *b = kmp_graph_implicit(g, block);
    kmp_ref list = KMP_ZERO;
    for (int l = b ? b->block.arguments : 0; l-- > 0;)
        list = kmp_binary(g, KMP_OP_LIST, arguments[l], list);
    for (int j = 0; b && j < b->block.unknowns; j++)
        unknowns[j] = kmp_implicit_component(g, block, j, list);
}

/* -- derivatives ------------------------------------------------------------------------------------- */

static kmp_ref import_leaf(const kmp_setting *s, const kmp_graph *local, uint32_t id)
{
    const kmp_node *n = kmp_graph_node(local, id);
    if (n->op == KMP_OP_CONST)
        return kmp_const(s->g, kmp_graph_value(local, id));
    return n->a == KMP_IN_Q           ? s->unknowns[n->b]
           : n->a == KMP_IN_PARAMETER ? s->arguments[n->b]
                                      : s->differentials[n->b];
}

bool kmp_local_import(const kmp_setting *s, const kmp_graph *local, int count, kmp_ref *refs)
{
    uint32_t nodes = kmp_graph_count(local);
    kmp_arena room = {0};
    uint8_t *live = KMP_ARENA_NEW(&room, uint8_t, nodes);
    kmp_ref *map = KMP_ARENA_NEW(&room, kmp_ref, nodes);
    bool ok = !room.failed;
    if (ok)
        kmp_live_mark(local, count, refs, live);
    for (uint32_t id = 0; ok && id < nodes; id++)
        if (live[id])
            map[id] = kmp_op_form_of((kmp_op)kmp_graph_node(local, id)->op) == KMP_FORM_LEAF
                          ? import_leaf(s, local, id)
                          : kmp_graph_rebuild_by(s->g, local, id, map);
    for (int k = 0; ok && k < count; k++)
        refs[k] = kmp_mapped(map, refs[k]);
    kmp_arena_free(&room);
    return ok;
}

/* The block A x + b = 0 of n unknowns: arguments A row by row, then b; the number remembered by the graph. */
static int linear_block(kmp_graph *g, int n)
{
    for (int k = 0; kmp_graph_implicit(g, k); k++)
        if (kmp_graph_implicit(g, k)->block.linear && kmp_graph_implicit(g, k)->block.unknowns == n)
            return k;
    kmp_graph *local = kmp_graph_new();
    kmp_ref residual[MOST], guess[MOST] = {0};
    if (!local)
        return kmp_graph_add_implicit(g, NULL);
    for (int i = 0; i < n; i++) {
        residual[i] = kmp_input(local, KMP_IN_PARAMETER, (uint32_t)(n * n + i));
        for (int j = 0; j < n; j++)
            residual[i] = kmp_add(local, residual[i],
                                  kmp_mul(local, kmp_input(local, KMP_IN_PARAMETER, (uint32_t)(i * n + j)),
                                          kmp_input(local, KMP_IN_Q, (uint32_t)j)));
    }
    kmp_implicit *b = kmp_implicit_new(local, n, n * n + n, residual, guess);
    if (b)
        b->block.linear = true;
    return kmp_graph_add_implicit(g, b);
}

/* Cramer's rule, which for two unknowns is as good as elimination (Higham, Accuracy and Stability of Numerical
 * Algorithms, 2002, section 1.10). */
static kmp_ref derivative_of_two(kmp_graph *g, const kmp_ref *equations, int component)
{
    const kmp_ref *a = equations, *b = equations + 4;
    kmp_ref det = kmp_sub(g, kmp_mul(g, a[0], a[3]), kmp_mul(g, a[1], a[2]));
    kmp_ref top = component == 0 ? kmp_sub(g, kmp_mul(g, a[1], b[1]), kmp_mul(g, a[3], b[0]))
                                 : kmp_sub(g, kmp_mul(g, a[2], b[0]), kmp_mul(g, a[0], b[1]));
    return kmp_div(g, top, det);
}

kmp_ref kmp_implicit_derivative(kmp_graph *g, int block, int component, kmp_ref list, kmp_ref differentials)
{
    const kmp_implicit *b = kmp_graph_implicit(g, block);
    if (b->block.averages && kmp_places_of_build())
        return kmp_places_of_build()->derivative(g, block, component, list, differentials);
    int n = b->block.unknowns, m = b->block.arguments;
    kmp_ref *p = KMP_GRAPH_NEW(g, kmp_ref, 2 * m), y[MOST], dy[MOST] = {0}, equations[MOST * MOST + MOST] = {0};
    if (!p || differentials == KMP_ZERO)
        return KMP_ZERO;
    kmp_list_items(g, list, m, p);
    kmp_list_items(g, differentials, m, p + m);
    for (int j = 0; j < n; j++)
        y[j] = kmp_implicit_component(g, block, j, list);
    for (int i = 0; i < n * n; i++)
        equations[i] = b->slope[i];
    for (int i = 0; i < n; i++)
        equations[n * n + i] = b->change[i];
    const kmp_setting s = {g, y, p, p + m};
    if (!kmp_local_import(&s, b->local, n * n + n, equations))
        kmp_graph_fail(g);
    if (n == 1)
        return kmp_neg(kmp_div(g, equations[1], equations[0]));
    if (n == 2)
        return derivative_of_two(g, equations, component);
    kmp_implicit_at(g, linear_block(g, n), equations, dy);
    return dy[component];
}

/* -- equations of a graph as a block of it ---------------------------------------------------------------- */

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
