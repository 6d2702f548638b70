/* SPDX-License-Identifier: BSD-3-Clause */
/* The graph of expressions: hash-consing, signs and commutative order. A node is only made when no rule has a shorter
 * form, by the rules below. Equal expressions are one node, so that an expression that occurs twice is an
 * auxiliary variable (Fisette and Samin 1996, section 3.1).
 *
 * A reference is the number of a node and a sign, so that a negative costs no node. Numbers follow the order of making:
 * operands are older than their uses, every traversal is a loop, and results do not depend on addresses. The table of
 * nodes is open-addressed and searched from near the youngest operand, where a large graph is in the cache. */
#include "symbolic/graph.h"
#include "base/arena.h"
#include "base/memory.h"
#include "symbolic/blocks.h"
#include "symbolic/derivative.h"
#include "symbolic/implicit.h"
#include "symbolic/label.h"
#include "symbolic/ops.h"
#include "symbolic/solving.h"
#include "symbolic/table_function.h"
#include "symbolic/trig.h"
#include <math.h>
#include <string.h>

struct kmp_graph {
    kmp_graph_head head; /* first */
    uint32_t capacity, value_count, value_capacity;
    uint32_t room_for; /* nodes, before `nodes` or `table` grows */
    uint32_t *table;   /* id + 1, 0 = free */
    uint32_t table_size, first_size;
    uint32_t *input[KMP_IN_COUNT]; /* by kind and index: id + 1 of a node that was this input; of as many */
    uint32_t inputs[KMP_IN_COUNT];
    kmp_rotations *rotations;
    struct kmp_derivative *spare;
    struct kmp_partials *spare_partials;
    kmp_label *labels; /* by id; fewer than nodes */
    uint32_t label_count;
    kmp_table **tables;
    int table_count;
    kmp_implicit **implicits, **unused; /* unused: averages of a state that the graph has returned from */
    int implicit_count, unused_count;
    kmp_arena arena;
    bool keeps_labels, failed;
};

/* -- nodes ----------------------------------------------------------------------------------------- */

static uint32_t mix(uint32_t op, uint32_t a, uint32_t b, uint32_t c)
{
    uint64_t k = ((uint64_t)a << 32 | b) * 0x9e3779b97f4a7c15u + ((uint64_t)c << 8 | op);
    k ^= k >> 29;
    k *= 0xbf58476d1ce4e5b9u;
    return (uint32_t)(k >> 32);
}

static uint32_t hash_node(const kmp_graph *g, const kmp_node *n)
{
    uint64_t bits;
    if (n->op != KMP_OP_CONST)
        return mix(n->op, n->a, n->b, n->c);
    memcpy(&bits, &g->head.values[n->a], sizeof bits);
    return mix(n->op, (uint32_t)bits, (uint32_t)(bits >> 32), 0);
}

static bool same_node(const kmp_graph *g, const kmp_node *n, const kmp_node *m)
{
    if (n->op != m->op)
        return false;
    if (n->op == KMP_OP_CONST)
        return memcmp(&g->head.values[n->a], &g->head.values[m->a], sizeof(double)) == 0;
    return n->a == m->a && n->b == m->b && n->c == m->c;
}

/* Graphs of blocks have some hundred nodes, and graphs of equations up to some hundred thousand. */
enum { WINDOW = 4096, NEAR = 16, LEAST = 1024, WIDER = 4 };

/* The place after k, where `step` probes have been made. */
static inline uint32_t next_slot(uint32_t *hash, int step, uint32_t k)
{
    if (step % NEAR != 0)
        return k + 1;
    k = *hash;
    *hash = *hash * 0x9e3779b1u + 1;
    return k;
}

/* The slot of the equal node (if `shared`), or a free one. */
static uint32_t find_slot(const kmp_graph *g, const kmp_node *n, bool shared)
{
    /* The search begins near the youngest operand, mostly one of the last nodes made, so that a large graph uses a
     * small part of its table. After each few probes it continues anywhere: windows of operands that many nodes share
     * are full from end to end. */
    const uint32_t youngest = kmp_op_arity((kmp_op)n->op) == 0 ? 0 : kmp_id(n->b > n->a ? n->b : n->a);
    uint32_t hash = hash_node(g, n), last = g->table_size - 1;
    uint32_t k = ((2 * youngest & ~(WINDOW - 1u)) + (hash & (WINDOW - 1u))) & last;
    for (int step = 1; g->table[k] && !(shared && same_node(g, &g->head.nodes[g->table[k] - 1], n)); step++)
        k = next_slot(&hash, step, k) & last;
    return k;
}

static bool grow_table(kmp_graph *g)
{
    uint32_t size = g->table_size ? WIDER * g->table_size : g->first_size, *table = KMP_NEW(uint32_t, size);
    if (!table)
        return false;
    kmp_free(g->table);
    g->table = table;
    g->table_size = size;
    /* Enters all nodes into a table without entries. */
    for (uint32_t id = 0; id < g->head.count; id++)
        g->table[find_slot(g, &g->head.nodes[id], false)] = id + 1;
    return true;
}

static bool grow_nodes(kmp_graph *g)
{
    uint32_t capacity = g->capacity ? 2 * g->capacity : g->first_size / 2;
    kmp_node *nodes = kmp_realloc(g->head.nodes, capacity, sizeof *nodes);
    if (!nodes)
        return false;
    g->head.nodes = nodes;
    g->capacity = capacity;
    return true;
}

/* More room for nodes; half of the table remains free. */
static bool make_room(kmp_graph *g)
{
    if (g->failed || g->head.count >= UINT32_MAX / 4 || (g->head.count == g->table_size / 2 && !grow_table(g)) ||
        (g->head.count == g->capacity && !grow_nodes(g)))
        return false;
    g->room_for = g->table_size / 2 < g->capacity ? g->table_size / 2 : g->capacity;
    return true;
}

static uint16_t depends_of(const kmp_graph *g, const kmp_node *n)
{
    if (n->op == KMP_OP_CONST)
        return 0;
    if (n->op == KMP_OP_INPUT)
        return (uint16_t)(1u << n->a);
    uint16_t d = 0;
    for (int k = 0; k < kmp_op_arity((kmp_op)n->op); k++)
        d |= g->head.nodes[kmp_id(kmp_operand(n, k))].depends;
    return d;
}

static kmp_ref add_node(kmp_graph *g, kmp_node n, uint32_t slot)
{
    g->head.nodes[g->head.count] = n;
    g->table[slot] = ++g->head.count;
    return (g->head.count - 1) << 1;
}

/* The node, or an equal one that exists. */
kmp_ref kmp_graph_intern(kmp_graph *g, kmp_node n)
{
    if (g->head.count == g->room_for && !make_room(g)) {
        g->failed = true;
        return KMP_ZERO;
    }
    bool shared = g->head.rules & KMP_RULE_SHARE || n.op == KMP_OP_CONST || n.op == KMP_OP_INPUT;
    uint32_t k = find_slot(g, &n, shared);
    if (g->table[k])
        return (g->table[k] - 1) << 1;
    n.depends = depends_of(g, &n);
    return add_node(g, n, k);
}

/* kmp_graph_intern of a sum, product or quotient, which most nodes are. */
static inline kmp_ref intern_pair(kmp_graph *g, kmp_op op, kmp_ref a, kmp_ref b)
{
    const kmp_node n = {.op = (uint8_t)op, .a = a, .b = b};
    if (g->head.count == g->room_for || !(g->head.rules & KMP_RULE_SHARE))
        return kmp_graph_intern(g, n);
    uint32_t hash = mix(op, a, b, 0), last = g->table_size - 1, slot;
    uint32_t k = (((b > a ? b : a) & ~(WINDOW - 1u)) + (hash & (WINDOW - 1u))) & last;
    for (int step = 1; (slot = g->table[k]) != 0; step++) {
        const kmp_node *m = &g->head.nodes[slot - 1];
        if (m->a == a && m->b == b && m->op == op)
            return (slot - 1) << 1;
        k = next_slot(&hash, step, k) & last;
    }
    uint16_t depends = g->head.nodes[kmp_id(a)].depends | g->head.nodes[kmp_id(b)].depends;
    return add_node(g, (kmp_node){.op = (uint8_t)op, .depends = depends, .a = a, .b = b}, k);
}

kmp_graph *kmp_graph_new(void)
{
    return kmp_graph_new_for(0);
}

kmp_graph *kmp_graph_new_for(uint32_t nodes)
{
    kmp_graph *g = KMP_NEW(kmp_graph, 1);
    if (!g)
        return NULL;
    for (g->first_size = LEAST; g->first_size / 2 < nodes && g->first_size < UINT32_MAX / WIDER;)
        g->first_size *= WIDER;
    g->head.rules = KMP_RULE_ALL;
    g->rotations = kmp_rotations_new();
    (void)kmp_const(g, 0.0);
    (void)kmp_const(g, 1.0);
    if (g->failed || !g->rotations || g->head.count != 2) {
        kmp_graph_free(g);
        return NULL;
    }
    return g;
}

void kmp_graph_set_rules(kmp_graph *g, unsigned rules)
{
    g->head.rules = rules;
}

void kmp_graph_free(kmp_graph *g)
{
    if (!g)
        return;
    kmp_derivatives_discard(g->spare);
    kmp_partials_discard(g->spare_partials);
    kmp_rotations_free(g->rotations);
    kmp_free(g->labels);
    for (int k = 0; k < g->table_count; k++)
        kmp_table_free(g->tables[k]);
    kmp_free(g->tables);
    for (int k = 0; k < g->implicit_count; k++)
        kmp_implicit_free(g->implicits[k]);
    for (int k = 0; k < g->unused_count; k++)
        kmp_implicit_free(g->unused[k]);
    kmp_free(g->implicits);
    kmp_free(g->unused);
    kmp_free(g->head.nodes);
    kmp_free(g->head.values);
    kmp_free(g->table);
    for (int kind = 0; kind < KMP_IN_COUNT; kind++)
        kmp_free(g->input[kind]);
    kmp_arena_free(&g->arena);
    kmp_free(g);
}

kmp_arena *kmp_graph_arena(kmp_graph *g)
{
    return &g->arena;
}

void kmp_graph_fail(kmp_graph *g)
{
    g->failed = true;
}

bool kmp_graph_failed(const kmp_graph *g)
{
    return g->failed || g->arena.failed || kmp_rotations_failed(g->rotations);
}

struct kmp_derivative **kmp_graph_spare(kmp_graph *g)
{
    return &g->spare;
}

struct kmp_partials **kmp_graph_spare_partials(kmp_graph *g)
{
    return &g->spare_partials;
}

kmp_rotations *kmp_graph_rotations(kmp_graph *g)
{
    return g->rotations;
}

/* -- states to return to --------------------------------------------------------------------------- */

bool kmp_graph_mark_init(kmp_graph_mark *mark, const kmp_graph *g)
{
    *mark = (kmp_graph_mark){g->head.count, g->value_count, g->table_count, g->implicit_count,
                             kmp_rotations_copy(g->rotations)};
    return mark->rotations;
}

KMP_CLEARS(kmp_graph_mark, mark, kmp_rotations_free(mark->rotations))

void kmp_graph_return(kmp_graph *g, const kmp_graph_mark *mark)
{
    kmp_derivatives_forget(g->spare);
    /* Forgets the nodes from this number on. No search for an older node passes the slot of a younger one: nodes are
     * entered in their order, also into a wider table. */
    uint32_t first = mark->nodes;
    uint32_t size = g->table_size;
    uint32_t *table = g->table;
    for (uint32_t k = 0; k < size; k++)
        table[k] = table[k] > first ? 0 : table[k];
    g->head.count = first;
    g->value_count = mark->values;
    while (g->table_count > mark->tables)
        kmp_table_free(g->tables[--g->table_count]);
    int count = mark->implicits;
    while (g->implicit_count > count) {
        /* Averages are kept: they take the most time to make, and the next derivation mostly needs them again. */
        kmp_implicit *block = g->implicits[--g->implicit_count];
        kmp_implicit **unused = NULL;
        if (block->derived)
            unused = kmp_realloc(g->unused, (size_t)g->unused_count + 1, sizeof(kmp_implicit *));
        if (!unused) {
            kmp_implicit_free(block);
            continue;
        }
        g->unused = unused;
        unused[g->unused_count++] = block;
    }
    for (int k = 0; k < count + g->unused_count; k++) {
        const kmp_implicit *block = k < count ? g->implicits[k] : g->unused[k - count];
        if (block->derived && *block->derived >= (k < count ? count : 0))
            *block->derived = -1;
    }
    for (uint32_t k = mark->nodes; k < g->label_count; k++)
        g->labels[k] = (kmp_label){0};
    kmp_rotations_assign(g->rotations, mark->rotations);
}

/* -- construction ---------------------------------------------------------------------------------- */

kmp_ref kmp_const(kmp_graph *g, double value)
{
    if (value == 0 && g->head.count > 0)
        return KMP_ZERO;
    if (fabs(value) == 1 && g->head.count > 1)
        return value < 0 ? kmp_neg(KMP_ONE) : KMP_ONE;
    bool negative = value < 0;
    if (g->value_count == g->value_capacity) {
        uint32_t capacity = g->value_capacity ? 2 * g->value_capacity : 64;
        double *values = kmp_realloc(g->head.values, capacity, sizeof *values);
        if (!values) {
            g->failed = true;
            return KMP_ZERO;
        }
        g->head.values = values;
        g->value_capacity = capacity;
    }
    g->head.values[g->value_count] = fabs(value);
    uint32_t before = g->head.count;
    kmp_ref r = kmp_graph_intern(g, (kmp_node){.op = KMP_OP_CONST, .a = g->value_count});
    if (g->head.count > before)
        g->value_count++;
    return negative ? kmp_neg(r) : r;
}

/* Notes the node of an input. */
static void note_input(kmp_graph *g, kmp_input_kind kind, uint32_t index, uint32_t id)
{
    if (index >= g->inputs[kind]) {
        const uint32_t more = 2 * index + 8;
        uint32_t *grown = kmp_realloc(g->input[kind], more, sizeof *grown);
        g->failed = g->failed || !grown;
        if (!grown)
            return;
        memset(grown + g->inputs[kind], 0, (more - g->inputs[kind]) * sizeof *grown);
        g->input[kind] = grown;
        g->inputs[kind] = more;
    }
    g->input[kind][index] = id + 1;
}

kmp_ref kmp_input(kmp_graph *g, kmp_input_kind kind, uint32_t index)
{
    const uint32_t known = index < g->inputs[kind] ? g->input[kind][index] : 0;
    if (known > 0 && known <= g->head.count) { /* the graph may have returned from that node */
        const kmp_node *n = &g->head.nodes[known - 1];
        if (n->op == KMP_OP_INPUT && n->a == (uint32_t)kind && n->b == index)
            return (known - 1) << 1;
    }
    const kmp_ref made = kmp_graph_intern(g, (kmp_node){.op = KMP_OP_INPUT, .a = (uint32_t)kind, .b = index});
    if (!g->failed)
        note_input(g, kind, index, kmp_id(made));
    return made;
}

static bool is_number(const kmp_graph *g, kmp_ref r)
{
    return g->head.nodes[kmp_id(r)].op == KMP_OP_CONST;
}

/* -- rules at the birth of a node -------------------------------------------------------------------- */

/* The rules of the graph: zeros and ones, cancellation of terms, squares collected, and sin^2 + cos^2 = 1. Each looks
 * one or two levels deep, since it runs for every node that is made. */

/* r = coefficient * base, the coefficient a number; the base, without sign. */
static kmp_ref split_coefficient(const kmp_graph *g, kmp_ref r, double *coefficient)
{
    const kmp_node *n = kmp_graph_node(g, kmp_id(r));
    double sign = kmp_is_negative(r) ? -1 : 1;
    if (n->op == KMP_OP_MUL && kmp_is_const(g, n->a, coefficient)) {
        *coefficient *= sign;
        return n->b;
    }
    *coefficient = sign;
    return r & ~(kmp_ref)1;
}

/* -- zeros ------------------------------------------------------------------------------------------ */

/* Zero elimination: zeros and ones vanish, numbers are computed at once and come first in a product. */

/* KMP_RULE_ZERO: zeros, ones, arithmetic of numbers. a and b of products and quotients are without sign, `sign` is
 * the sign of the result; a product has its number first. */
static bool fold_sum(kmp_graph *g, kmp_ref a, kmp_ref b, kmp_ref *result)
{
    double x, y;
    if (a == KMP_ZERO)
        *result = b;
    else if (b == KMP_ZERO)
        *result = a;
    else if (kmp_is_const(g, a, &x) && kmp_is_const(g, b, &y))
        *result = kmp_const(g, x + y);
    else
        return false;
    return true;
}

static bool fold_product(kmp_graph *g, kmp_ref a, kmp_ref b, kmp_ref sign, kmp_ref *result)
{
    double x, y;
    if (a == KMP_ZERO || b == KMP_ZERO) {
        *result = KMP_ZERO;
        return true;
    }
    if (a == KMP_ONE || b == KMP_ONE) {
        *result = (a == KMP_ONE ? b : a) ^ sign;
        return true;
    }
    if (!kmp_is_const(g, a, &x))
        return false;
    if (kmp_is_const(g, b, &y)) {
        *result = kmp_const(g, sign ? -x * y : x * y);
        return true;
    }
    kmp_ref base = split_coefficient(g, b, &y);
    if (base == b)
        return false;
    *result = kmp_mul(g, kmp_const(g, sign ? -x * y : x * y), base);
    return true;
}

static bool fold_quotient(kmp_graph *g, kmp_ref a, kmp_ref b, kmp_ref sign, kmp_ref *result)
{
    double x, y;
    if (kmp_is_const(g, b, &y)) {
        bool number = kmp_is_const(g, a, &x);
        *result = number ? kmp_const(g, sign ? -x / y : x / y) : kmp_mul(g, a, kmp_const(g, sign ? -1 / y : 1 / y));
        return true;
    }
    *result = KMP_ZERO;
    return a == KMP_ZERO;
}

/* -- cancellation ----------------------------------------------------------------------------------- */

/* Cancellation: terms that differ by a numeric factor only become one. */

/* KMP_RULE_CANCEL: a - a, 2 a + 3 a. */
static bool cancel_same(kmp_graph *g, kmp_ref a, kmp_ref b, kmp_ref *result)
{
    double x, y;
    *result = KMP_ZERO;
    if (a == kmp_neg(b))
        return true;
    kmp_ref p = split_coefficient(g, a, &x), q = split_coefficient(g, b, &y);
    if (p != q)
        return false;
    *result = kmp_mul(g, kmp_const(g, x + y), p);
    return true;
}

/* (p + q) + b where b cancels p or q, or where p and b are numbers. */
static bool add_to_sum(kmp_graph *g, kmp_ref sum, kmp_ref b, kmp_ref *result)
{
    kmp_node n = *kmp_graph_node(g, kmp_id(sum));
    double x, y;
    if (n.op != KMP_OP_ADD)
        return false;
    kmp_ref p = kmp_is_negative(sum) ? kmp_neg(n.a) : n.a;
    kmp_ref q = kmp_is_negative(sum) ? kmp_neg(n.b) : n.b;
    if (p == kmp_neg(b))
        *result = q;
    else if (q == kmp_neg(b))
        *result = p;
    else if (kmp_is_const(g, p, &x) && kmp_is_const(g, b, &y))
        *result = kmp_add(g, kmp_const(g, x + y), q);
    else
        return false;
    return true;
}

/* -- squares ---------------------------------------------------------------------------------------- */

/* Squares are collected: squares of rates occur in many terms. */

/* KMP_RULE_SHARE, in addition to equal nodes: (p w) w = p (w w), without sign. */
static bool collect(kmp_graph *g, kmp_ref product, kmp_ref w, kmp_ref *result)
{
    kmp_node n = *kmp_graph_node(g, kmp_id(product));
    if (n.op != KMP_OP_MUL || is_number(g, w))
        return false;
    if (n.b == w && n.a != w)
        *result = kmp_mul(g, n.a, kmp_mul(g, w, w));
    else if (n.a == w && n.b != w)
        *result = kmp_mul(g, n.b, kmp_mul(g, w, w));
    else
        return false;
    return true;
}

/* -- sums of squares -------------------------------------------------------------------------------- */

/* True for f(x)^2 with f = op; x in *argument. */
static bool is_square_of(const kmp_graph *g, kmp_ref r, kmp_op op, kmp_ref *argument)
{
    const kmp_node *n = kmp_graph_node(g, kmp_id(r));
    if (n->op != KMP_OP_MUL || n->a != n->b || kmp_graph_node(g, kmp_id(n->a))->op != op)
        return false;
    *argument = kmp_graph_node(g, kmp_id(n->a))->a;
    return true;
}

/* KMP_RULE_TRIG, in addition to rotated pairs (symbolic/trig.h): x cos^2 + x sin^2 = x, x a number. */
static bool pythagoras(kmp_graph *g, kmp_ref a, kmp_ref b, kmp_ref *result)
{
    double x, y;
    kmp_ref p = split_coefficient(g, a, &x), q = split_coefficient(g, b, &y), v, w;
    bool squares = (is_square_of(g, p, KMP_OP_SIN, &v) && is_square_of(g, q, KMP_OP_COS, &w)) ||
                   (is_square_of(g, p, KMP_OP_COS, &v) && is_square_of(g, q, KMP_OP_SIN, &w));
    if (x != y || !squares || v != w)
        return false;
    *result = kmp_const(g, x);
    return true;
}

/* Numbers first, then by id. */
static void order_operands(const kmp_graph *g, kmp_ref *a, kmp_ref *b)
{
    bool swap = is_number(g, *a) != is_number(g, *b) ? is_number(g, *b) : kmp_id(*b) < kmp_id(*a);
    if (swap) {
        kmp_ref c = *a;
        *a = *b;
        *b = c;
    }
}

static bool is_square(const kmp_graph *g, kmp_ref r)
{
    const kmp_node *n = &g->head.nodes[kmp_id(r)];
    return n->op == KMP_OP_MUL && n->a == n->b;
}

/* The rules that may have a shorter form of a sum; each looks further. `same`: the terms differ by a number. */
static inline unsigned rules_of_sum(const kmp_graph *g, kmp_ref a, kmp_ref b, bool *same)
{
    const kmp_node *x = &g->head.nodes[kmp_id(a)], *y = &g->head.nodes[kmp_id(b)];
    double coefficient;
    kmp_ref p = split_coefficient(g, a, &coefficient), q = split_coefficient(g, b, &coefficient);
    *same = p == q;
    bool numbers = x->op == KMP_OP_CONST && y->op == KMP_OP_CONST, sums = x->op == KMP_OP_ADD || y->op == KMP_OP_ADD;
    return g->head.rules &
           ((a == KMP_ZERO || b == KMP_ZERO || numbers ? KMP_RULE_ZERO : 0u) | (p == q || sums ? KMP_RULE_CANCEL : 0u) |
            (is_square(g, p) && is_square(g, q) ? KMP_RULE_TRIG : 0u));
}

kmp_ref kmp_graph_add(kmp_graph *g, kmp_ref a, kmp_ref b)
{
    kmp_ref r;
    bool same;
    unsigned rules = rules_of_sum(g, a, b, &same);
    if (rules && ((rules & KMP_RULE_ZERO && fold_sum(g, a, b, &r)) ||
                  (rules & KMP_RULE_CANCEL && same && cancel_same(g, a, b, &r)) ||
                  (rules & KMP_RULE_TRIG && pythagoras(g, a, b, &r)) ||
                  (rules & KMP_RULE_CANCEL && (add_to_sum(g, a, b, &r) || add_to_sum(g, b, a, &r)))))
        return r;
    order_operands(g, &a, &b);
    kmp_ref sign = a & 1;
    return intern_pair(g, KMP_OP_ADD, a ^ sign, b ^ sign) ^ sign;
}

/* True if w is a factor of the product p, which then may have it squared. */
static bool has_factor(const kmp_graph *g, kmp_ref p, kmp_ref w)
{
    const kmp_node *n = &g->head.nodes[kmp_id(p)];
    return n->op == KMP_OP_MUL && (n->a == w || n->b == w);
}

kmp_ref kmp_graph_mul(kmp_graph *g, kmp_ref a, kmp_ref b)
{
    kmp_ref r, sign = (a ^ b) & 1;
    a &= ~(kmp_ref)1;
    b &= ~(kmp_ref)1;
    order_operands(g, &a, &b);
    if (is_number(g, a) && g->head.rules & KMP_RULE_ZERO && fold_product(g, a, b, sign, &r))
        return r;
    bool squares = g->head.rules & KMP_RULE_SHARE && (has_factor(g, a, b) || has_factor(g, b, a));
    if (squares && (collect(g, a, b, &r) || collect(g, b, a, &r))) {
        if (g->failed)
            return KMP_ZERO;
        return sign ? kmp_neg(r) : r;
    }
    return intern_pair(g, KMP_OP_MUL, a, b) ^ sign;
}

kmp_ref(kmp_div)(kmp_graph *g, kmp_ref a, kmp_ref b)
{
    kmp_ref r, sign = (a ^ b) & 1;
    a &= ~(kmp_ref)1;
    b &= ~(kmp_ref)1;
    if (g->head.rules & KMP_RULE_ZERO && fold_quotient(g, a, b, sign, &r))
        return r;
    if (g->head.rules & KMP_RULE_CANCEL && a == b)
        return KMP_ONE ^ sign;
    return intern_pair(g, KMP_OP_DIV, a, b) ^ sign;
}

/* -- tables ---------------------------------------------------------------------------------------- */

int kmp_graph_find_points(const kmp_graph *g, kmp_table_method method, int count, const double *x, const double *y)
{
    int k = 0;
    while (k < g->table_count && !kmp_table_is_of(g->tables[k], method, count, x, y))
        k++;
    return k < g->table_count ? k : -1;
}

int kmp_graph_add_table(kmp_graph *g, kmp_table *table)
{
    for (int k = 0; table && k < g->table_count; k++)
        if (kmp_table_equal(g->tables[k], table))
            return k;
    kmp_table **tables = kmp_realloc(g->tables, (size_t)g->table_count + 1, sizeof(kmp_table *));
    if (tables)
        g->tables = tables;
    if (!tables || !table) {
        g->failed = true;
        return -1;
    }
    g->tables[g->table_count] = kmp_table_share(table);
    return g->table_count++;
}

kmp_table *kmp_graph_table(const kmp_graph *g, int table)
{
    return table >= 0 && table < g->table_count ? g->tables[table] : NULL;
}

int kmp_graph_add_implicit(kmp_graph *g, kmp_implicit *block)
{
    for (int k = 0; block && k < g->implicit_count; k++)
        if (kmp_implicit_equal(g->implicits[k], block)) {
            kmp_implicit_free(block);
            return k;
        }
    kmp_implicit **blocks = kmp_realloc(g->implicits, (size_t)g->implicit_count + 1, sizeof(kmp_implicit *));
    g->implicits = blocks ? blocks : g->implicits;
    if (!blocks || !block) {
        kmp_implicit_free(block);
        g->failed = true;
        return -1;
    }
    blocks[g->implicit_count] = block;
    return g->implicit_count++;
}

int kmp_graph_find_implicit(kmp_graph *g, kmp_implicit_test *is, const void *user)
{
    for (int k = 0; k < g->implicit_count; k++)
        if (is(g->implicits[k], user))
            return k;
    for (int k = 0; k < g->unused_count; k++)
        if (is(g->unused[k], user)) {
            kmp_implicit *block = g->unused[k];
            g->unused[k] = g->unused[--g->unused_count];
            return kmp_graph_add_implicit(g, block);
        }
    return -1;
}

const kmp_implicit *kmp_graph_implicit(const kmp_graph *g, int block)
{
    return block >= 0 && block < g->implicit_count ? g->implicits[block] : NULL;
}

/* -- labels ---------------------------------------------------------------------------------------- */

void kmp_graph_keep_labels(kmp_graph *g)
{
    g->keeps_labels = true;
}

bool kmp_graph_has_labels(const kmp_graph *g)
{
    return g->keeps_labels;
}

static bool reserve_label(kmp_graph *g, uint32_t id)
{
    if (id < g->label_count)
        return true;
    uint32_t count = 2 * id + 256;
    kmp_label *labels = kmp_realloc(g->labels, count, sizeof *labels);
    if (!labels) {
        g->failed = true;
        return false;
    }
    for (uint32_t k = g->label_count; k < count; k++)
        labels[k] = (kmp_label){0};
    g->labels = labels;
    g->label_count = count;
    return true;
}

void kmp_graph_label(kmp_graph *g, kmp_ref r, kmp_label label)
{
    uint32_t id = kmp_id(r);
    bool leaf = kmp_op_arity((kmp_op)kmp_graph_node(g, id)->op) == 0;
    if (!g->keeps_labels || leaf || !reserve_label(g, id) || g->labels[id].quantity)
        return;
    label.negative = label.negative != kmp_is_negative(r);
    g->labels[id] = label;
}

const kmp_label *kmp_graph_label_of(const kmp_graph *g, uint32_t id)
{
    return id < g->label_count && g->labels[id].quantity ? &g->labels[id] : NULL;
}

/* -- digests --------------------------------------------------------------------------------------- */

static uint64_t mix_digest(uint64_t digest, uint64_t more)
{
    digest = (digest ^ more) * 0x9e3779b97f4a7c15u;
    return digest ^ digest >> 29;
}

uint64_t kmp_graph_digest(const kmp_graph *g, uint32_t first, int count, const kmp_ref *outputs)
{
    uint64_t digest = mix_digest(kmp_graph_count(g), (uint64_t)count);
    for (uint32_t id = first; id < kmp_graph_count(g); id++) {
        const kmp_node *n = kmp_graph_node(g, id);
        uint64_t whole = (uint64_t)n->b << 32 | n->c;
        if (n->op == KMP_OP_CONST) {
            const double value = kmp_graph_value(g, id);
            memcpy(&whole, &value, sizeof whole);
        }
        digest = mix_digest(mix_digest(digest, (uint64_t)n->a << 8 | n->op), whole);
    }
    for (int k = 0; k < count; k++)
        digest = mix_digest(digest, outputs[k]);
    return digest;
}

/* -- values ---------------------------------------------------------------------------------------- */

static double operand(const double *value, kmp_ref r)
{
    return kmp_is_negative(r) ? -value[kmp_id(r)] : value[kmp_id(r)];
}

static double value_of(const kmp_graph *g, const kmp_node *n, const double *value)
{
    double x[3] = {0};
    for (int k = 0; k < kmp_op_arity((kmp_op)n->op); k++)
        x[k] = operand(value, kmp_operand(n, k));
    if (n->op == KMP_OP_IMPLICIT) {
        const kmp_program_block *block = kmp_implicit_block(kmp_graph_implicit(g, (int)n->b));
        kmp_solving *solving = kmp_solving_new(block, NULL);
        double y = NAN;
        kmp_ref list = n->a;
        for (int l = 0; solving && l < block->arguments; l++, list = kmp_graph_node(g, kmp_id(list))->b)
            kmp_solving_arguments(solving)[l] = operand(value, kmp_graph_node(g, kmp_id(list))->a);
        if (solving)
            y = kmp_solving_value(solving, (int)n->c);
        kmp_solving_free(solving);
        return y;
    }
    if (n->op == KMP_OP_TABLE)
        return kmp_table_value(kmp_graph_table(g, (int)n->b), (int)n->c, x[0]);
    return kmp_op_value((kmp_op)n->op, x[0], x[1], x[2]);
}

void kmp_graph_eval(const kmp_graph *g, const double *const inputs[KMP_IN_COUNT], double *value)
{
    kmp_graph_eval_live(g, inputs, NULL, value);
}

void kmp_graph_eval_live(const kmp_graph *g, const double *const inputs[KMP_IN_COUNT], const uint8_t *live,
                         double *value)
{
    for (uint32_t id = 0; id < kmp_graph_count(g); id++) {
        if (live && !live[id])
            continue;
        const kmp_node *n = kmp_graph_node(g, id);
        if (n->op == KMP_OP_CONST)
            value[id] = kmp_graph_value(g, id);
        else if (n->op == KMP_OP_INPUT)
            value[id] = inputs[n->a] ? inputs[n->a][n->b] : NAN;
        else
            value[id] = value_of(g, n, value);
    }
}
