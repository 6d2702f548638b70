/* SPDX-License-Identifier: BSD-3-Clause */
/* A hash table from result pairs (and their quarter turns) to their source and angle. */
#include "symbolic/rotation.h"
#include "base/memory.h"
#include <string.h>

typedef struct entry {
    kmp_ref first, second; /* the rotated pair; first = 0: free */
    kmp_ref y, z, angle;
} entry;

struct kmp_rotations {
    entry *entries;
    uint32_t count, size;
    uint32_t *of_node; /* of_node[id] = 1 + index of an entry whose `first` is the node, made on demand */
    uint32_t node_capacity;
    bool failed;
};

kmp_rotations *kmp_rotations_new(void)
{
    return KMP_NEW(kmp_rotations, 1);
}

void kmp_rotations_free(kmp_rotations *r)
{
    if (!r)
        return;
    kmp_free(r->entries);
    kmp_free(r->of_node);
    kmp_free(r);
}

/* The table has the room of the copy, or more. */
static void assign(kmp_rotations *r, const kmp_rotations *from)
{
    entry *entries = r->entries;
    uint32_t *of_node = r->of_node;
    if (from->size)
        memcpy(entries, from->entries, from->size * sizeof *entries);
    if (from->node_capacity)
        memcpy(of_node, from->of_node, from->node_capacity * sizeof *of_node);
    *r = *from;
    r->entries = entries;
    r->of_node = of_node;
}

kmp_rotations *kmp_rotations_copy(const kmp_rotations *r)
{
    kmp_rotations *copy = kmp_rotations_new();
    if (!copy)
        return NULL;
    copy->entries = KMP_NEW(entry, r->size);
    copy->of_node = KMP_NEW(uint32_t, r->node_capacity);
    if (copy->entries && copy->of_node) {
        assign(copy, r);
        return copy;
    }
    kmp_rotations_free(copy);
    return NULL;
}

void kmp_rotations_assign(kmp_rotations *r, const kmp_rotations *copy)
{
    bool failed = r->failed;
    assign(r, copy);
    r->failed = failed;
}

bool kmp_rotations_failed(const kmp_rotations *r)
{
    return r->failed;
}

static uint32_t slot(const kmp_rotations *r, kmp_ref first, kmp_ref second)
{
    uint32_t k = (first * 0x9e3779b1u ^ second * 0x85ebca6bu);
    k ^= k >> 15;
    for (k &= r->size - 1; r->entries[k].first != KMP_ZERO; k = (k + 1) & (r->size - 1))
        if (r->entries[k].first == first && r->entries[k].second == second)
            break;
    return k;
}

static bool reserve(kmp_rotations *r)
{
    if (2 * (r->count + 4) <= r->size)
        return true;
    entry *old = r->entries;
    uint32_t old_size = r->size, size = old_size ? 2 * old_size : 256;
    entry *entries = KMP_NEW(entry, size);
    if (!entries) {
        r->failed = true;
        return false;
    }
    r->entries = entries;
    r->size = size;
    for (uint32_t i = 0; i < old_size; i++)
        if (old[i].first != KMP_ZERO)
            entries[slot(r, old[i].first, old[i].second)] = old[i];
    kmp_free(old);
    for (uint32_t i = 0; i < r->node_capacity; i++)
        r->of_node[i] = 0;
    for (uint32_t i = 0; i < size; i++)
        if (entries[i].first != KMP_ZERO && !kmp_is_negative(entries[i].first) &&
            kmp_id(entries[i].first) < r->node_capacity)
            r->of_node[kmp_id(entries[i].first)] = i + 1;
    return true;
}

static void note_node(kmp_rotations *r, uint32_t id, uint32_t index)
{
    if (id >= r->node_capacity) {
        uint32_t capacity = 2 * id + 256;
        uint32_t *of_node = kmp_realloc(r->of_node, capacity, sizeof *of_node);
        if (!of_node) {
            r->failed = true;
            return;
        }
        for (uint32_t i = r->node_capacity; i < capacity; i++)
            of_node[i] = 0;
        r->of_node = of_node;
        r->node_capacity = capacity;
    }
    if (r->of_node[id] == 0)
        r->of_node[id] = index + 1;
}

static void remember(kmp_rotations *r, kmp_ref first, kmp_ref second, kmp_ref y, kmp_ref z, kmp_ref angle)
{
    if (first == KMP_ZERO || !reserve(r))
        return;
    uint32_t k = slot(r, first, second);
    if (r->entries[k].first != KMP_ZERO)
        return;
    r->entries[k] = (entry){first, second, y, z, angle};
    r->count++;
    if (!kmp_is_negative(first))
        note_node(r, kmp_id(first), k);
}

/* True if a pair is remembered; then its quarter turns are, too. */
static bool is_known(const kmp_rotations *r, kmp_ref first, kmp_ref second)
{
    return first != KMP_ZERO && r->size && r->entries[slot(r, first, second)].first != KMP_ZERO;
}

/* -- angles ---------------------------------------------------------------------------------------- */

enum { MAX_TERMS = 64 };

/* The terms of a sum; the returned number may exceed the number stored. */
static int flatten(const kmp_graph *g, kmp_ref a, kmp_ref *terms, int count)
{
    const kmp_node *n = kmp_graph_node(g, kmp_id(a));
    if (n->op != KMP_OP_ADD || count >= MAX_TERMS) {
        if (count < MAX_TERMS)
            terms[count] = a;
        return count + 1;
    }
    count = flatten(g, n->a ^ (a & 1), terms, count);
    return flatten(g, n->b ^ (a & 1), terms, count);
}

kmp_ref kmp_angle_add(kmp_graph *g, kmp_ref a, kmp_ref b)
{
    kmp_ref terms[MAX_TERMS], sum = KMP_ZERO;
    int n = flatten(g, b, terms, flatten(g, a, terms, 0));
    if (n > MAX_TERMS)
        return kmp_add(g, a, b);
    for (int i = 1; i < n; i++) /* by id: from the root of the tree outwards */
        for (int k = i; k > 0 && kmp_id(terms[k]) < kmp_id(terms[k - 1]); k--) {
            kmp_ref t = terms[k];
            terms[k] = terms[k - 1];
            terms[k - 1] = t;
        }
    for (int i = 0; i < n; i++) {
        if (i + 1 < n && terms[i] == kmp_neg(terms[i + 1]))
            i++;
        else
            sum = kmp_add(g, sum, terms[i]);
    }
    return sum;
}

/* -- the rotation ---------------------------------------------------------------------------------- */

void kmp_rotate(kmp_graph *g, kmp_ref angle, kmp_ref *y, kmp_ref *z)
{
    kmp_rotations *r = kmp_graph_rotations(g);
    bool collapse = kmp_graph_has_rule(g, KMP_RULE_TRIG);
    if (*y == KMP_ZERO && *z == KMP_ZERO && kmp_graph_has_rule(g, KMP_RULE_ZERO))
        return;
    /* A pair beginning with zero is stored under its quarter turn: (0, z) turned back is (z, 0). */
    kmp_ref first = *y, second = *z;
    bool turned = first == KMP_ZERO;
    if (turned) {
        first = *z;
        second = KMP_ZERO;
    }
    if (r->size && collapse) {
        const entry *e = &r->entries[slot(r, first, second)];
        kmp_ref sum = e->first != KMP_ZERO ? kmp_angle_add(g, e->angle, angle) : angle;
        if (e->first != KMP_ZERO && (sum == KMP_ZERO || kmp_graph_has_rule(g, KMP_RULE_RUNS))) {
            *y = turned ? kmp_neg(e->z) : e->y;
            *z = turned ? e->y : e->z;
            angle = sum;
        }
    }
    if (angle == KMP_ZERO)
        return;
    kmp_ref y0 = *y, z0 = *z, c = kmp_cos(g, angle), s = kmp_sin(g, angle);
    *y = kmp_sub(g, kmp_mul(g, y0, c), kmp_mul(g, z0, s));
    *z = kmp_add(g, kmp_mul(g, y0, s), kmp_mul(g, z0, c));
    if (!collapse || is_known(r, *y, *z))
        return;
    remember(r, *y, *z, y0, z0, angle);
    remember(r, kmp_neg(*z), *y, kmp_neg(z0), y0, angle);
    remember(r, kmp_neg(*y), kmp_neg(*z), kmp_neg(y0), kmp_neg(z0), angle);
    remember(r, *z, kmp_neg(*y), z0, kmp_neg(y0), angle);
}

bool kmp_rotated_pair(kmp_graph *g, uint32_t id, kmp_pair *pair)
{
    const kmp_rotations *r = kmp_graph_rotations(g);
    if (id >= r->node_capacity || r->of_node[id] == 0)
        return false;
    const entry *e = &r->entries[r->of_node[id] - 1];
    *pair = (kmp_pair){e->y, e->z, e->angle, e->second};
    return kmp_id(e->y) < id && kmp_id(e->z) < id && kmp_id(e->angle) < id; /* otherwise it would lead to a cycle */
}
