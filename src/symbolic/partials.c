/* SPDX-License-Identifier: BSD-3-Clause */
/* Hides the users of each node, in compressed lists; from a leaf upwards they give all nodes that depend on it. */
#include "symbolic/partials.h"
#include "base/arena.h"
#include "base/memory.h"
#include "symbolic/derivative.h"
#include "symbolic/rotation.h"
#include <stdlib.h>

struct kmp_partials {
    kmp_graph *g;
    kmp_arena room; /* of all arrays */
    kmp_derivative *derivative;
    uint32_t count;         /* nodes up to the last of the expressions */
    uint32_t *rank;         /* of each node: 1 + its number among the needed ones; 0: not needed */
    uint32_t needed;        /* nodes that derivatives of the expressions need */
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

/* False: no memory. */
static bool init(kmp_partials *p)
{
    for (int k = 0; k < p->roots; k++)
        p->count = kmp_id(p->of[k]) < p->count ? p->count : kmp_id(p->of[k]) + 1;
    p->derivative = kmp_derivative_of_few(p->g);
    p->rank = KMP_ARENA_NEW(&p->room, uint32_t, p->count);
    if (!p->rank || !p->derivative)
        return false;
    /* Numbers the nodes that derivatives of the expressions need: their operands, and the sources of rotated pairs. */
    uint32_t *rank = p->rank;
    kmp_pair pair;
    for (int k = 0; k < p->roots; k++)
        rank[kmp_id(p->of[k])] = 1;
    for (uint32_t id = p->count; id-- > 0;) {
        if (!rank[id])
            continue;
        const kmp_node *n = kmp_graph_node(p->g, id);
        for (int k = 0; k < kmp_op_arity((kmp_op)n->op); k++)
            rank[kmp_id(kmp_operand(n, k))] = 1;
        if (kmp_rotated_pair(p->g, id, &pair))
            rank[kmp_id(pair.y)] = rank[kmp_id(pair.z)] = rank[kmp_id(pair.angle)] = 1;
    }
    for (uint32_t id = 0; id < p->count; id++)
        if (rank[id])
            rank[id] = ++p->needed;
    KMP_ARENA_MAKE(&p->room, KMP_ROOM(uint32_t, p->needed + 1, &p->first, &p->first_root),
                   KMP_ROOM(int, p->roots, &p->root, &p->which), KMP_ROOM(bool, p->needed, &p->met),
                   KMP_ROOM(uint32_t, p->needed, &p->found), KMP_ROOM(kmp_ref, p->roots, &p->value));
    if (p->room.failed)
        return false;
    /* The users among the needed nodes. */
    for (uint32_t id = 0; id < p->count; id++) {
        const kmp_node *n = kmp_graph_node(p->g, id);
        for (int k = 0; p->rank[id] && k < kmp_op_arity((kmp_op)n->op); k++)
            p->first[number_of(p, kmp_id(kmp_operand(n, k))) + 1]++;
    }
    add_up(p->first, p->needed);
    p->user = KMP_ARENA_NEW(&p->room, uint32_t, p->first[p->needed]);
    for (uint32_t id = 0; p->user && id < p->count; id++) {
        const kmp_node *n = kmp_graph_node(p->g, id);
        for (int k = 0; p->rank[id] && k < kmp_op_arity((kmp_op)n->op); k++)
            p->user[p->first[number_of(p, kmp_id(kmp_operand(n, k)))]++] = id;
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

kmp_partials *kmp_partials_new(kmp_graph *g, int count, const kmp_ref *of)
{
    kmp_partials *p = KMP_NEW(kmp_partials, 1);
    if (p)
        *p = (kmp_partials){.g = g, .roots = count, .of = of};
    if (p && init(p))
        return p;
    kmp_partials_free(p);
    kmp_graph_fail(g);
    return NULL;
}

void kmp_partials_free(kmp_partials *p)
{
    if (!p)
        return;
    kmp_derivative_free(p->derivative);
    kmp_arena_free(&p->room);
    kmp_free(p);
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
    bool ok = kmp_derivative_begin(p->derivative, leaf, KMP_ONE, found, p->found);
    for (int k = 0; ok && k < count; k++)
        p->value[k] = kmp_derivative_of(p->derivative, p->of[p->which[k]]);
    kmp_derivative_end(p->derivative, found, p->found);
    return ok && !kmp_graph_failed(p->g) ? count : -1;
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
