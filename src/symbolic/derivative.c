/* SPDX-License-Identifier: BSD-3-Clause */
/* Chain rule per node, from the operands up. A rotated pair (Y, Z) = Rot(a) (y, z) uses dY = Rot(a) (dy, dz) . e1 - Z
 * da, whose parts mostly exist in the graph already. */
#include "symbolic/derivative.h"
#include "base/arena.h"
#include "base/memory.h"
#include "symbolic/function_table.h"
#include "symbolic/implicit.h"
#include "symbolic/ops.h"
#include "symbolic/stack.h"
#include "symbolic/trig.h"
#include <stdlib.h>
#include <string.h>

#define UNKNOWN UINT32_MAX

struct kmp_derivative {
    kmp_graph *g;
    kmp_derivative *next; /* another one that is not in use */
    kmp_ref *memo;        /* by id; UNKNOWN where not yet derived */
    uint32_t capacity;
    uint32_t *known, known_count; /* ids of the nodes in memo; unused with `few` */
    kmp_stack stack;
    kmp_ref *seed; /* leaves, then their directions */
    int seed_count, seed_room;
    unsigned rules;   /* of the graph, when the memo was begun */
    uint16_t depends; /* inputs that move */
    bool few;         /* memo already holds the constant nodes, as zero */
};

/* Room in memo for ids below n. */
static bool reserve(kmp_derivative *d, uint32_t n)
{
    if (d->memo && n <= d->capacity)
        return true;
    uint32_t capacity = n + n / 2 + 64;
    kmp_ref *memo = kmp_realloc(d->memo, capacity, sizeof *memo);
    if (!memo)
        return false;
    d->memo = memo;
    uint32_t *known = d->few ? NULL : kmp_realloc(d->known, capacity, sizeof *known);
    if (!d->few && !known)
        return false;
    d->known = known;
    for (uint32_t i = d->capacity; i < capacity; i++)
        memo[i] = d->few ? KMP_ZERO : UNKNOWN;
    d->capacity = capacity;
    return true;
}

static void set(kmp_derivative *d, uint32_t id, kmp_ref value)
{
    if (!d->few && d->memo[id] == UNKNOWN)
        d->known[d->known_count++] = id;
    d->memo[id] = value;
}

static void forget(kmp_derivative *d)
{
    for (uint32_t k = 0; k < d->known_count; k++)
        d->memo[d->known[k]] = UNKNOWN;
    d->known_count = 0;
    d->seed_count = 0;
    d->depends = 0;
}

/* Notes the leaves and directions of the memo. Without memory there are none, and the memo is not used again. */
static void note_seed(kmp_derivative *d, int count, const kmp_ref *leaf, const kmp_ref *direction)
{
    size_t size = (size_t)count * sizeof *leaf;
    if (count > d->seed_room) {
        kmp_ref *seed = kmp_realloc(d->seed, 2 * (size_t)count, sizeof *seed);
        if (!seed)
            return;
        d->seed = seed;
        d->seed_room = count;
    }
    if (count > 0) {
        memcpy(d->seed, leaf, size);
        memcpy(d->seed + count, direction, size);
    }
    d->seed_count = count;
    d->rules = kmp_graph_rules(d->g);
}

/* True if the memo is of these leaves and directions, in the graph as it grew since then: where equal nodes are one,
 * its derivatives are the ones that would be made again. */
static bool continues(const kmp_derivative *d, int count, const kmp_ref *leaf, const kmp_ref *direction)
{
    size_t size = (size_t)count * sizeof *leaf;
    return kmp_graph_has_rule(d->g, KMP_RULE_SHARE) && d->seed_count == count && d->rules == kmp_graph_rules(d->g) &&
           memcmp(d->seed, leaf, size) == 0 && memcmp(d->seed + count, direction, size) == 0;
}

bool kmp_derivative_restart(kmp_derivative *d, int count, const kmp_ref *leaf, const kmp_ref *direction)
{
    forget(d);
    if (!reserve(d, kmp_graph_count(d->g))) {
        kmp_graph_fail(d->g);
        return false;
    }
    for (int k = 0; k < count; k++) {
        set(d, kmp_id(leaf[k]), direction[k]);
        d->depends |= kmp_graph_node(d->g, kmp_id(leaf[k]))->depends;
    }
    note_seed(d, count, leaf, direction);
    return true;
}

static void discard(kmp_derivative *d)
{
    if (!d)
        return;
    kmp_free(d->memo);
    kmp_free(d->known);
    kmp_free(d->seed);
    kmp_free(d->stack.id);
    kmp_free(d);
}

static kmp_derivative *allocate(kmp_graph *g, bool few)
{
    kmp_derivative *d = KMP_NEW(kmp_derivative, 1);
    if (d)
        *d = (kmp_derivative){.g = g, .few = few};
    if (d && reserve(d, kmp_graph_count(g)))
        return d;
    kmp_graph_fail(g);
    discard(d);
    return NULL;
}

/* Rates and accelerations are derived in turn. */
enum { SPARES = 2 };

kmp_derivative *kmp_derivative_new(kmp_graph *g, int count, const kmp_ref *leaf, const kmp_ref *direction)
{
    /* The one that is not in use and continues along the same direction, otherwise the last one of as many as are kept.
     */
    kmp_derivative **at = kmp_graph_spare(g);
    int number = 0;
    while (*at && !continues(*at, count, leaf, direction) && (++number < SPARES || (*at)->next))
        at = &(*at)->next;
    kmp_derivative *d = *at;
    if (d)
        *at = d->next;
    else
        d = allocate(g, false);
    if (d && !continues(d, count, leaf, direction))
        (void)kmp_derivative_restart(d, count, leaf, direction);
    return d;
}

void kmp_derivative_free(kmp_derivative *d)
{
    kmp_derivative **spare = d && !d->few ? kmp_graph_spare(d->g) : NULL;
    if (!spare || (*spare && (*spare)->next)) {
        discard(d);
        return;
    }
    d->next = *spare;
    *spare = d;
}

void kmp_derivatives_forget(kmp_derivative *d)
{
    for (; d; d = d->next)
        forget(d);
}

void kmp_derivatives_discard(kmp_derivative *d)
{
    while (d) {
        kmp_derivative *next = d->next;
        discard(d);
        d = next;
    }
}

/* True if the differential is available without deeper recursion. */
static bool settled(kmp_derivative *d, uint32_t id)
{
    if (d->memo[id] != UNKNOWN)
        return true;
    const kmp_node *n = kmp_graph_node(d->g, id);
    if ((n->depends & d->depends) == 0 || n->op == KMP_OP_INPUT) {
        set(d, id, KMP_ZERO);
        return true;
    }
    return false;
}

static kmp_ref of(const kmp_derivative *d, kmp_ref x)
{
    kmp_ref r = d->memo[kmp_id(x)];
    return kmp_is_negative(x) ? kmp_neg(r) : r;
}

/* -- rules of the rows ------------------------------------------------------------------------------- */

/* sqrt(1 - x^2) */
static kmp_ref circle(kmp_graph *g, kmp_ref x)
{
    return kmp_sqrt(g, kmp_sub(g, KMP_ONE, kmp_mul(g, x, x)));
}

/* d(x^y) = y x^(y - 1) dx + x^y log x dy: no logarithm where the exponent is constant. */
static kmp_ref power_differential(kmp_graph *g, kmp_ref x, kmp_ref y, kmp_ref f, kmp_ref dx, kmp_ref dy)
{
    kmp_ref lower = dx != KMP_ZERO ? kmp_binary(g, KMP_OP_POW, x, kmp_sub(g, y, KMP_ONE)) : KMP_ZERO;
    kmp_ref d = kmp_mul(g, kmp_mul(g, y, lower), dx);
    if (dy == KMP_ZERO)
        return d;
    return kmp_add(g, d, kmp_mul(g, kmp_mul(g, f, kmp_unary(g, KMP_OP_LOG, x)), dy));
}

/* d atan2(x, y) = (y dx - x dy) / (x^2 + y^2) */
static kmp_ref angle_differential(kmp_graph *g, kmp_ref x, kmp_ref y, kmp_ref dx, kmp_ref dy)
{
    kmp_ref square = kmp_add(g, kmp_mul(g, x, x), kmp_mul(g, y, y));
    return kmp_div(g, kmp_sub(g, kmp_mul(g, y, dx), kmp_mul(g, x, dy)), square);
}

/* df/dx, or the differential itself for functions of several variables. */
static kmp_ref derive_function(kmp_graph *g, const kmp_node *n, kmp_ref f, const kmp_ref differential[3])
{
    kmp_ref x = n->a, y = n->b, z = n->c, dx = differential[0], dy = differential[1], dz = differential[2];
#define RULE(name, rule)                                                                                               \
    case KMP_OP_##name:                                                                                                \
        return rule;
    (void)z;
    switch ((kmp_op)n->op) {
#define KMP_LEAF(name)
#define KMP_BINARY(name, text, value)
#define KMP_UNARY(name, text, parity, value, derivative)     RULE(name, kmp_mul(g, derivative, dx))
#define KMP_BINARY_FUNCTION(name, text, value, differential) RULE(name, differential)
#define KMP_TERNARY(name, text, value, differential)         RULE(name, differential)
#define KMP_APPLIED(name, text)
#include "symbolic/ops_end.h"
    default:
        return KMP_ZERO;
    }
#undef RULE
}

/* p / sqrt(x), where x is a factor of p: finite where x is zero. KMP_ZERO: it is none. */
static kmp_ref over_root(kmp_graph *g, kmp_ref p, kmp_ref x, kmp_ref root)
{
    const kmp_node n = *kmp_graph_node(g, kmp_id(p));
    if (kmp_id(p) == kmp_id(x))
        return p == x ? root : KMP_ZERO;
    if (n.op != KMP_OP_MUL)
        return KMP_ZERO;
    kmp_ref a = over_root(g, n.a, x, root), b = a == KMP_ZERO ? over_root(g, n.b, x, root) : KMP_ZERO;
    kmp_ref both = a != KMP_ZERO ? kmp_mul(g, a, n.b) : b != KMP_ZERO ? kmp_mul(g, n.a, b) : KMP_ZERO;
    return kmp_is_negative(p) ? kmp_neg(both) : both;
}

/* A product p sqrt(x) with x a factor of p, and p / sqrt(x). */
typedef struct half_product {
    kmp_ref p, x, root, rest;
} half_product;

/* Operand k of the product as the root. False: the node has another form. */
static bool half_power_of(kmp_graph *g, const kmp_node *n, int k, half_product *power)
{
    const kmp_ref root = k ? n->b : n->a, p = k ? n->a : n->b;
    const kmp_node s = *kmp_graph_node(g, kmp_id(root));
    if (n->op != KMP_OP_MUL || s.op != KMP_OP_SQRT || kmp_is_negative(root))
        return false;
    *power = (half_product){p, s.a, root, over_root(g, p, s.a, root)};
    return power->rest != KMP_ZERO;
}

/* d(p sqrt(x)) = dp sqrt(x) + p / sqrt(x) dx / 2, of a power such as max(x, 0)^1.5. KMP_ZERO: it is none. */
static kmp_ref derive_half_power(kmp_derivative *d, const kmp_node *n, const kmp_ref differential[3])
{
    half_product h;
    for (int k = 0; n->op == KMP_OP_MUL && k < 2; k++)
        if (differential[k] != KMP_ZERO && half_power_of(d->g, n, k, &h))
            return kmp_add(d->g, kmp_mul(d->g, differential[1 - k], h.root),
                           kmp_mul(d->g, kmp_mul(d->g, kmp_const(d->g, 0.5), h.rest), of(d, h.x)));
    return KMP_ZERO;
}

/* `pair`: NULL for a node of no rotated pair. */
static kmp_ref derive(kmp_derivative *d, uint32_t id, const kmp_pair *pair)
{
    kmp_graph *g = d->g;
    if (pair) {
        kmp_ref dy = of(d, pair->y), dz = of(d, pair->z);
        kmp_rotate(d->g, pair->angle, &dy, &dz);
        return kmp_sub(d->g, dy, kmp_mul(d->g, pair->second, of(d, pair->angle)));
    }
    kmp_node n = *kmp_graph_node(g, id);
    kmp_ref differential[3] = {0};
    for (int k = 0; k < kmp_op_arity((kmp_op)n.op); k++)
        differential[k] = of(d, kmp_operand(&n, k));
    kmp_ref half_power = derive_half_power(d, &n, differential);
    if (half_power != KMP_ZERO)
        return half_power;
    switch (kmp_op_form_of((kmp_op)n.op)) {
    case KMP_FORM_LEAF:
        return KMP_ZERO;
    case KMP_FORM_INFIX:
        switch ((kmp_op)n.op) {
        case KMP_OP_ADD:
            return kmp_add(g, differential[0], differential[1]);
        case KMP_OP_MUL:
            return kmp_add(g, kmp_mul(g, differential[0], n.b), kmp_mul(g, n.a, differential[1]));
        default: /* d(a/b) = (da - (a/b) db) / b */
            return kmp_div(g, kmp_sub(g, differential[0], kmp_mul(g, id << 1, differential[1])), n.b);
        }
    case KMP_FORM_APPLIED:
        if (n.op == KMP_OP_IMPLICIT)
            return kmp_implicit_derivative(g, (int)n.b, (int)n.c, n.a, differential[0]);
        return kmp_mul(g, kmp_table_derivative_at(g, (int)n.b, (int)n.c + 1, n.a), differential[0]);
    default:
        return derive_function(g, &n, id << 1, differential);
    }
}

/* The differentials that derive(id) needs; returns their number. */
static int needs(kmp_derivative *d, uint32_t id, const kmp_pair *pair, uint32_t need[3])
{
    if (pair) {
        need[0] = kmp_id(pair->y);
        need[1] = kmp_id(pair->z);
        need[2] = kmp_id(pair->angle);
        return 3;
    }
    const kmp_node *n = kmp_graph_node(d->g, id);
    int arity = kmp_op_arity((kmp_op)n->op);
    for (int k = 0; k < arity; k++)
        need[k] = kmp_id(kmp_operand(n, k));
    return arity;
}

static kmp_ref give_up(kmp_derivative *d)
{
    kmp_graph_fail(d->g);
    return KMP_ZERO;
}

kmp_ref kmp_derivative_of(kmp_derivative *d, kmp_ref x)
{
    if (!d)
        return KMP_ZERO;
    d->stack.top = 0;
    if (kmp_graph_failed(d->g) || !reserve(d, kmp_graph_count(d->g)) || !kmp_push(&d->stack, kmp_id(x)))
        return give_up(d);
    while (d->stack.top) {
        uint32_t id = d->stack.id[d->stack.top - 1], need[3] = {0};
        if (settled(d, id)) {
            d->stack.top--;
            continue;
        }
        kmp_pair rotated, *pair = kmp_rotated_pair(d->g, id, &rotated) ? &rotated : NULL;
        int count = needs(d, id, pair, need), open = 0;
        for (int k = 0; k < count; k++)
            if (!settled(d, need[k])) {
                if (!kmp_push(&d->stack, need[k]))
                    return give_up(d);
                open++;
            }
        if (open)
            continue;
        set(d, id, derive(d, id, pair));
        d->stack.top--;
    }
    return of(d, x);
}

void kmp_derivatives_by(kmp_graph *g, kmp_ref leaf, int count, const kmp_ref *of, kmp_ref *slope)
{
    static const kmp_ref one = KMP_ONE;
    kmp_derivative *d = kmp_derivative_new(g, 1, &leaf, &one);
    for (int i = 0; i < count; i++)
        slope[i] = kmp_derivative_of(d, of[i]);
    kmp_derivative_free(d);
}

/* -- partial derivatives ----------------------------------------------------------------------------- */

/* Hides the users of each node, in compressed lists; from a leaf upwards they give all nodes that depend on it. */

struct kmp_partials {
    kmp_graph *g;
    kmp_arena room; /* of all arrays */
    kmp_derivative *derivative;
    uint32_t count;         /* nodes up to the last of the expressions */
    uint32_t *rank;         /* of each node: 1 + its number among the needed ones; 0: not needed */
    uint32_t capacity;      /* of rank */
    uint32_t needed;        /* nodes that derivatives of the expressions need */
    kmp_stack cone;         /* their ids, ascending */
    uint32_t *first, *user; /* users of each needed node */
    uint32_t *first_root;   /* expressions that are each needed node */
    int *root;
    int roots;
    const kmp_ref *of;
    bool *met;
    uint32_t *found; /* nodes that depend on the leaf */
    int *which;
    kmp_ref *value;
};

/* Counts at first[i + 1] to where each list begins. */
static void add_up(uint32_t *first, uint32_t count)
{
    for (uint32_t i = 0; i < count; i++)
        first[i + 1] += first[i];
}

/* Beginnings that have moved to the ends of their lists, back. */
static void begin_again(uint32_t *first, uint32_t count)
{
    for (uint32_t i = count; i > 0; i--)
        first[i] = first[i - 1];
    first[0] = 0;
}

static uint32_t number_of(const kmp_partials *p, uint32_t id)
{
    return p->rank[id] - 1;
}

/* Notes that a node is needed. False: no memory. */
static bool need(kmp_partials *p, uint32_t id)
{
    if (p->rank[id])
        return true;
    p->rank[id] = 1;
    return kmp_push(&p->cone, id);
}

static int compare_ids(const void *a, const void *b)
{
    uint32_t x = *(const uint32_t *)a, y = *(const uint32_t *)b;
    return (x > y) - (x < y);
}

/* Lists the nodes that derivatives of the expressions need: their operands, and the sources of rotated pairs; and
 * numbers them. False: no memory. */
static bool find_cone(kmp_partials *p)
{
    kmp_pair pair;
    bool ok = true;
    for (int k = 0; ok && k < p->roots; k++)
        ok = need(p, kmp_id(p->of[k]));
    for (uint32_t at = 0; ok && at < p->cone.top; at++) {
        const uint32_t id = p->cone.id[at];
        const kmp_node *n = kmp_graph_node(p->g, id);
        for (int k = 0; ok && k < kmp_op_arity((kmp_op)n->op); k++)
            ok = need(p, kmp_id(kmp_operand(n, k)));
        if (ok && kmp_rotated_pair(p->g, id, &pair))
            ok = need(p, kmp_id(pair.y)) && need(p, kmp_id(pair.z)) && need(p, kmp_id(pair.angle));
    }
    if (ok && p->cone.top > 1)
        qsort(p->cone.id, p->cone.top, sizeof *p->cone.id, compare_ids);
    p->needed = p->cone.top;
    for (uint32_t i = 0; ok && i < p->needed; i++)
        p->rank[p->cone.id[i]] = i + 1;
    return ok;
}

/* Ranks of all nodes, as zero. False: no memory. */
static bool reserve_ranks(kmp_partials *p)
{
    if (p->rank && p->count <= p->capacity)
        return true;
    const uint32_t capacity = p->count + p->count / 2 + 64;
    uint32_t *rank = kmp_realloc(p->rank, capacity, sizeof *rank);
    if (!rank)
        return false;
    memset(rank + p->capacity, 0, (capacity - p->capacity) * sizeof *rank);
    p->rank = rank;
    p->capacity = capacity;
    return true;
}

/* False: no memory. */
static bool init(kmp_partials *p)
{
    p->count = 0;
    for (int k = 0; k < p->roots; k++)
        p->count = kmp_id(p->of[k]) < p->count ? p->count : kmp_id(p->of[k]) + 1;
    p->derivative = p->derivative ? p->derivative : allocate(p->g, true);
    if (!p->derivative || !reserve_ranks(p) || !find_cone(p))
        return false;
    KMP_ARENA_MAKE(&p->room, KMP_ROOM(uint32_t, p->needed + 1, &p->first, &p->first_root),
                   KMP_ROOM(int, p->roots, &p->root, &p->which), KMP_ROOM(bool, p->needed, &p->met),
                   KMP_ROOM(uint32_t, p->needed, &p->found), KMP_ROOM(kmp_ref, p->roots, &p->value));
    if (p->room.failed)
        return false;
    /* The users among the needed nodes. */
    for (uint32_t i = 0; i < p->needed; i++) {
        const kmp_node *n = kmp_graph_node(p->g, p->cone.id[i]);
        for (int k = 0; k < kmp_op_arity((kmp_op)n->op); k++)
            p->first[number_of(p, kmp_id(kmp_operand(n, k))) + 1]++;
    }
    add_up(p->first, p->needed);
    p->user = KMP_ARENA_NEW(&p->room, uint32_t, p->first[p->needed]);
    for (uint32_t i = 0; p->user && i < p->needed; i++) {
        const kmp_node *n = kmp_graph_node(p->g, p->cone.id[i]);
        for (int k = 0; k < kmp_op_arity((kmp_op)n->op); k++)
            p->user[p->first[number_of(p, kmp_id(kmp_operand(n, k)))]++] = p->cone.id[i];
    }
    begin_again(p->first, p->needed);
    for (int k = 0; k < p->roots; k++)
        p->first_root[number_of(p, kmp_id(p->of[k])) + 1]++;
    add_up(p->first_root, p->needed);
    for (int k = 0; k < p->roots; k++)
        p->root[p->first_root[number_of(p, kmp_id(p->of[k]))]++] = k;
    begin_again(p->first_root, p->needed);
    return !p->room.failed;
}

void kmp_partials_discard(kmp_partials *p)
{
    if (!p)
        return;
    kmp_derivative_free(p->derivative);
    kmp_arena_free(&p->room);
    kmp_free(p->rank);
    kmp_free(p->cone.id);
    kmp_free(p);
}

kmp_partials *kmp_partials_new(kmp_graph *g, int count, const kmp_ref *of)
{
    kmp_partials **spare = kmp_graph_spare_partials(g), *p = *spare ? *spare : KMP_NEW(kmp_partials, 1);
    *spare = NULL;
    if (p) {
        p->g = g;
        p->roots = count;
        p->of = of;
    }
    if (p && init(p))
        return p;
    kmp_partials_discard(p);
    kmp_graph_fail(g);
    return NULL;
}

/* Its arrays by nodes are left to the graph, for the next: most expressions in a large graph have few of its nodes. */
void kmp_partials_free(kmp_partials *p)
{
    kmp_partials **spare = p ? kmp_graph_spare_partials(p->g) : NULL;
    if (!spare || *spare) {
        kmp_partials_discard(p);
        return;
    }
    for (uint32_t i = 0; i < p->cone.top; i++)
        p->rank[p->cone.id[i]] = 0;
    p->cone.top = 0;
    kmp_arena_free(&p->room);
    *spare = p;
}

/* Marks a node that depends on the leaf, unless it is marked. */
static void meet(kmp_partials *p, uint32_t id, uint32_t *count)
{
    bool *met = &p->met[number_of(p, id)];
    if (!*met)
        p->found[(*count)++] = id;
    *met = true;
}

/* Collects the leaf, which is needed, and all nodes that depend on it in `found`; returns their number. */
static uint32_t climb(kmp_partials *p, uint32_t leaf)
{
    uint32_t count = 0;
    meet(p, leaf, &count);
    for (uint32_t at = 0; at < count; at++) {
        uint32_t i = number_of(p, p->found[at]);
        for (uint32_t k = p->first[i]; k < p->first[i + 1]; k++)
            meet(p, p->user[k], &count);
    }
    return count;
}

static int compare(const void *a, const void *b)
{
    int x = *(const int *)a, y = *(const int *)b;
    return (x > y) - (x < y);
}

int kmp_partials_along(kmp_partials *p, kmp_ref leaf, const int **which, const kmp_ref **value)
{
    int count = 0;
    if (!p)
        return -1;
    *which = p->which;
    *value = p->value;
    if (kmp_id(leaf) >= p->count || !p->rank[kmp_id(leaf)])
        return kmp_graph_failed(p->g) ? -1 : 0;
    uint32_t found = climb(p, kmp_id(leaf));
    for (uint32_t i = 0; i < found; i++) {
        uint32_t at = number_of(p, p->found[i]);
        p->met[at] = false;
        for (uint32_t k = p->first_root[at]; k < p->first_root[at + 1]; k++)
            p->which[count++] = p->root[k];
    }
    if (count > 1)
        qsort(p->which, (size_t)count, sizeof *p->which, compare);
    /* The derivative along the leaf, of which every node is constant that has not been found. */
    kmp_derivative *d = p->derivative;
    const bool ok = reserve(d, kmp_graph_count(p->g));
    for (uint32_t i = 0; ok && i < found; i++)
        d->memo[p->found[i]] = UNKNOWN;
    if (ok) {
        d->memo[kmp_id(leaf)] = KMP_ONE;
        d->depends = kmp_graph_node(p->g, kmp_id(leaf))->depends;
    }
    for (int k = 0; ok && k < count; k++)
        p->value[k] = kmp_derivative_of(d, p->of[p->which[k]]);
    for (uint32_t i = 0; i < found && p->found[i] < d->capacity; i++)
        d->memo[p->found[i]] = KMP_ZERO;
    return ok && !kmp_graph_failed(p->g) ? count : -1;
}

int kmp_gradient(kmp_graph *g, kmp_ref of, kmp_input_kind kind, int inputs, int **index, kmp_ref **slope)
{
    kmp_partials *partials = kmp_partials_new(g, 1, &of);
    int count = 0;
    if (!partials || !KMP_ARENA_MAKE(kmp_graph_arena(g), KMP_ROOM(int, partials->needed, index),
                                     KMP_ROOM(kmp_ref, partials->needed, slope))) {
        kmp_partials_free(partials);
        return 0;
    }
    for (uint32_t i = 0; i < partials->needed; i++) {
        const kmp_node *n = kmp_graph_node(g, partials->cone.id[i]);
        if (n->op == KMP_OP_INPUT && n->a == (uint32_t)kind && n->b < (uint32_t)inputs)
            (*index)[count++] = (int)n->b;
    }
    if (count > 1)
        qsort(*index, (size_t)count, sizeof **index, compare);
    for (int i = 0; i < count; i++) {
        const int *row;
        const kmp_ref *value;
        const int found = kmp_partials_along(partials, kmp_input(g, kind, (uint32_t)(*index)[i]), &row, &value);
        (*slope)[i] = found > 0 ? value[0] : KMP_ZERO;
    }
    kmp_partials_free(partials);
    return count;
}

void kmp_partials_all(kmp_graph *g, int count, const kmp_ref *of, kmp_input_kind kind, int inputs, kmp_ref *out)
{
    for (int k = 0; k < count * inputs; k++)
        out[k] = KMP_ZERO;
    for (int k = 0; k < inputs; k++)
        (void)kmp_input(g, kind, (uint32_t)k); /* all of them before others are made */
    kmp_partials *partials = kmp_partials_new(g, count, of);
    for (int k = 0; k < inputs; k++) {
        const int *row;
        const kmp_ref *value;
        int found = kmp_partials_along(partials, kmp_input(g, kind, (uint32_t)k), &row, &value);
        for (int i = 0; i < found; i++)
            out[row[i] * inputs + k] = value[i];
    }
    kmp_partials_free(partials);
}

/* -- from the expression down to the inputs ------------------------------------------------------------- */

/* The weight of a node is the derivative of the expression by it. A node hands its own on to the nodes that it needs,
 * times their slopes, after all its users have done so. The slopes of a value that is not chosen may be NaN: where a
 * node is only needed for such values, a choice leaves them out. */

typedef struct descent {
    kmp_derivative *d;
    uint16_t inputs; /* kinds of the leaves */
    uint32_t count;  /* nodes of the graph at the beginning */
    uint8_t *met;    /* by id */
    kmp_ref *weight; /* by id */
    kmp_ref *needed; /* by id: 1 where a chosen value needs the node, otherwise 0 */
    kmp_pair *pair;  /* by id: the rotated pair that the node is, as slopes may make it another one; angle 0: none */
    kmp_stack order; /* each node after all that it needs */
    kmp_ref *need;   /* room for the needs of a node */
    uint32_t most;
} descent;

static const kmp_pair *pair_of(const descent *x, uint32_t id)
{
    return x->pair[id].angle != KMP_ZERO ? &x->pair[id] : NULL;
}

/* Lists what a node needs: operands, the sources of a rotated pair, or the arguments of a block. -1: no memory. */
static int find_needs(descent *x, uint32_t id, const half_product *power)
{
    const kmp_graph *g = x->d->g;
    const kmp_node *n = kmp_graph_node(g, id);
    const kmp_implicit *block = n->op == KMP_OP_IMPLICIT ? kmp_graph_implicit(g, (int)n->b) : NULL;
    const uint32_t arguments = block ? (uint32_t)kmp_implicit_block(block)->arguments : 3;
    if (arguments > x->most) {
        kmp_ref *need = kmp_realloc(x->need, arguments, sizeof *need);
        if (!need)
            return -1;
        x->need = need;
        x->most = arguments;
    }
    if (block) {
        kmp_list_items(g, n->a, (int)arguments, x->need);
        return (int)arguments;
    }
    if (power) {
        x->need[0] = power->p;
        x->need[1] = power->x;
        return 2;
    }
    uint32_t need[3];
    const int count = needs(x->d, id, pair_of(x, id), need);
    for (int k = 0; k < count; k++)
        x->need[k] = need[k] << 1;
    return count;
}

/* False: the node has another form. */
static bool find_power(const descent *x, uint32_t id, half_product *power)
{
    const kmp_node n = *kmp_graph_node(x->d->g, id);
    return !pair_of(x, id) && (half_power_of(x->d->g, &n, 0, power) || half_power_of(x->d->g, &n, 1, power));
}

/* False: the expression does not move with this node. */
static bool moves(const descent *x, uint32_t id)
{
    return kmp_graph_node(x->d->g, id)->depends & x->inputs;
}

/* Sorts the nodes that move below one. False: no memory. */
static bool sort_below(descent *x, uint32_t top)
{
    kmp_stack open = {0};
    bool ok = kmp_push(&open, top);
    while (ok && open.top) {
        const uint32_t id = open.id[open.top - 1];
        if (x->met[id]) { /* 1: its needs are in order; 2: so is the node */
            open.top--;
            ok = x->met[id] == 2 || kmp_push(&x->order, id);
            x->met[id] = 2;
            continue;
        }
        x->met[id] = 1;
        half_product power;
        if (!kmp_rotated_pair(x->d->g, id, &x->pair[id]))
            x->pair[id] = (kmp_pair){.angle = KMP_ZERO};
        const bool is_power = find_power(x, id, &power);
        const int count = find_needs(x, id, is_power ? &power : NULL);
        ok = count >= 0;
        for (int k = 0; ok && k < count; k++) {
            const uint32_t below = kmp_id(x->need[k]);
            if (below < x->count && x->met[below] == 0 && moves(x, below))
                ok = kmp_push(&open, below);
        }
    }
    kmp_free(open.id);
    return ok;
}

/* 1 where the chosen value of a node needs this operand, if it needs the node. */
static kmp_ref chosen(descent *x, uint32_t id, uint32_t by)
{
    kmp_graph *g = x->d->g;
    const kmp_node n = *kmp_graph_node(g, id);
    const kmp_ref needed = x->needed[id];
    if (n.op == KMP_OP_SELECT && kmp_id(n.a) != by && kmp_id(n.b) != kmp_id(n.c))
        return kmp_id(n.b) == by ? kmp_select(g, n.a, needed, KMP_ZERO) : kmp_select(g, n.a, KMP_ZERO, needed);
    if ((n.op != KMP_OP_MIN && n.op != KMP_OP_MAX) || kmp_id(n.a) == kmp_id(n.b))
        return needed;
    const kmp_ref first = n.op == KMP_OP_MIN ? kmp_less(g, n.a, n.b) : kmp_less(g, n.b, n.a);
    return kmp_id(n.a) == by ? kmp_select(g, first, needed, KMP_ZERO) : kmp_select(g, first, KMP_ZERO, needed);
}

/* Hands a part of the weight of a node on to one that it needs. */
static void add_weight(descent *x, uint32_t id, kmp_ref to, kmp_ref slope)
{
    kmp_graph *g = x->d->g;
    const uint32_t by = kmp_id(to);
    const kmp_ref here = x->needed[id], needs_it = chosen(x, id, by);
    kmp_ref more = kmp_mul(g, x->weight[id], kmp_is_negative(to) ? kmp_neg(slope) : slope), *needed = &x->needed[by];
    if (here != KMP_ONE)
        more = kmp_select(g, here, more, KMP_ZERO);
    x->weight[by] = kmp_add(g, x->weight[by], more);
    if (*needed == KMP_ZERO || needs_it == KMP_ONE)
        *needed = needs_it;
    else if (*needed != KMP_ONE && *needed != needs_it)
        *needed = kmp_binary(g, KMP_OP_MAX, *needed, needs_it);
}

/* The slope of a node by one that it needs, whose differential is one while all others are zero. */
static kmp_ref slope_by(descent *x, uint32_t id, uint32_t by)
{
    kmp_derivative *d = x->d;
    d->memo[by] = KMP_ONE;
    const kmp_node n = *kmp_graph_node(d->g, id);
    kmp_ref list = KMP_ZERO, slope;
    if (n.op == KMP_OP_IMPLICIT) {
        const int arguments = kmp_implicit_block(kmp_graph_implicit(d->g, (int)n.b))->arguments;
        kmp_list_items(d->g, n.a, arguments, x->need);
        for (int l = arguments; l-- > 0;)
            list = kmp_binary(d->g, KMP_OP_LIST, of(d, x->need[l]), list);
        slope = kmp_implicit_derivative(d->g, (int)n.b, (int)n.c, n.a, list);
    } else {
        slope = derive(d, id, pair_of(x, id));
    }
    d->memo[by] = KMP_ZERO;
    return slope;
}

/* Hands the weight of a node on. False: no memory. */
static bool hand_on(descent *x, uint32_t id)
{
    kmp_graph *g = x->d->g;
    half_product power;
    if (x->weight[id] == KMP_ZERO || kmp_graph_node(g, id)->op == KMP_OP_INPUT)
        return true;
    if (find_power(x, id, &power)) {
        add_weight(x, id, power.p, power.root);
        add_weight(x, id, power.x, kmp_mul(g, kmp_const(g, 0.5), power.rest));
        return true;
    }
    const int count = find_needs(x, id, NULL);
    for (int k = 0; k < count; k++) {
        const uint32_t by = kmp_id(x->need[k]);
        bool before = false; /* one slope includes all places of an operand */
        for (int i = 0; i < k; i++)
            before = before || kmp_id(x->need[i]) == by;
        if (!before && moves(x, by))
            add_weight(x, id, by << 1, slope_by(x, id, by));
    }
    return count >= 0;
}

void kmp_gradient_backward(kmp_graph *g, kmp_ref of, int count, const kmp_ref *leaf, kmp_ref *slope)
{
    for (int k = 0; k < count; k++)
        slope[k] = KMP_ZERO;
    descent x = {.d = allocate(g, true), .count = kmp_graph_count(g)};
    kmp_arena room = {0};
    for (int k = 0; k < count; k++)
        x.inputs |= kmp_graph_node(g, kmp_id(leaf[k]))->depends;
    bool ok =
        x.d && KMP_ARENA_MAKE(&room, KMP_ROOM(uint8_t, x.count, &x.met),
                              KMP_ROOM(kmp_ref, x.count, &x.weight, &x.needed), KMP_ROOM(kmp_pair, x.count, &x.pair));
    ok = ok && (!moves(&x, kmp_id(of)) || sort_below(&x, kmp_id(of)));
    if (ok) {
        x.weight[kmp_id(of)] = kmp_is_negative(of) ? kmp_neg(KMP_ONE) : KMP_ONE;
        x.needed[kmp_id(of)] = KMP_ONE;
    }
    for (uint32_t i = x.order.top; ok && i-- > 0;)
        ok = hand_on(&x, x.order.id[i]);
    for (int k = 0; ok && k < count; k++)
        slope[k] = x.weight[kmp_id(leaf[k])];
    if (!ok)
        kmp_graph_fail(g);
    kmp_free(x.order.id);
    kmp_free(x.need);
    kmp_arena_free(&room);
    kmp_derivative_free(x.d);
}
