/* SPDX-License-Identifier: BSD-3-Clause */
/* Sums (products) are expanded to lists of terms (factors), including operands without other users. Pairs that occur in
 * two lists or more are made once, the most frequent first. The search is repeated with the new lists.
 *
 * A repetition counts only pairs with an item of the round before: another one is in one list at most, unless an item
 * is in a list twice. */
#include "base/arena.h"
#include "base/memory.h"
#include "symbolic/shorten.h"
#include <stdlib.h>
#include <string.h>

enum { LONGEST = 24, PASSES = 4 };

typedef struct list {
    uint32_t id;           /* of the node */
    int first, count, met; /* met: pairs that the present round counts */
    uint32_t newest;       /* the newest item that was made */
    bool changed, repeats; /* repeats: an item is in it twice */
} list;

/* Two items, the first positive and with the smaller number. */
typedef struct pair {
    kmp_ref a, b;
    int count, first; /* lists that have the pair; their position in `member` */
} pair;

typedef struct sharing {
    kmp_rewrite *r;
    kmp_op op;
    kmp_arena room;
    list *lists;
    int list_count;
    kmp_ref *items; /* of all lists; numbers from r.count on are pairs that were made */
    int item_count;
    pair *pairs;                 /* of the present round, as the next four */
    uint32_t *table, table_size; /* 1 + number of a pair, 0: free */
    int *met;                    /* the number of each pair that the lists have, in their order */
    int *member;
    int pair_count, met_count;
    kmp_ref (*made)[2]; /* operands of pairs that were made */
    uint32_t made_count;
    bool failed;
} sharing;

/* -- lists ------------------------------------------------------------------------------------------- */

static bool repeats(int count, const kmp_ref *item)
{
    for (int i = 0; i < count; i++)
        for (int j = 0; j < i; j++)
            if (kmp_id(item[i]) == kmp_id(item[j]))
                return true;
    return false;
}

/* Collects the nodes that are the head of a list: not part of another list. */
static void collect(sharing *s, const uint8_t *inside)
{
    for (uint32_t k = 0; k < s->r->live.top; k++) {
        uint32_t id = kmp_rewrite_live(s->r, k);
        if (inside[id] || kmp_graph_node(s->r->graph, id)->op != s->op)
            continue;
        kmp_ref found[KMP_MOST_TERMS], sign = 0;
        int count = kmp_rewrite_flatten(s->r, s->op, id << 1, found, &sign);
        if (count > LONGEST)
            continue;
        s->lists[s->list_count++] =
            (list){.id = id, .first = s->item_count, .count = count, .repeats = repeats(count, found)};
        memcpy(s->items + s->item_count, found, (size_t)count * sizeof *found);
        s->item_count += count;
    }
}

/* -- pairs ------------------------------------------------------------------------------------------- */

static void order(kmp_ref *a, kmp_ref *b)
{
    kmp_ref sign, x = *a, y = *b;
    if (kmp_id(y) < kmp_id(x)) {
        x = *b;
        y = *a;
    }
    sign = x & 1;
    *a = x ^ sign;
    *b = y ^ sign;
}

/* The number of a pair, a new one if it has not been met. */
static int find(sharing *s, kmp_ref a, kmp_ref b)
{
    uint32_t k = a * 0x9e3779b1u ^ b * 0x85ebca6bu;
    k = (k ^ k >> 15) & (s->table_size - 1);
    for (; s->table[k]; k = (k + 1) & (s->table_size - 1)) {
        const pair *p = &s->pairs[s->table[k] - 1];
        if (p->a == a && p->b == b)
            return (int)s->table[k] - 1;
    }
    s->table[k] = (uint32_t)s->pair_count + 1;
    s->pairs[s->pair_count] = (pair){a, b, 0, 0};
    return s->pair_count++;
}

static void free_round(sharing *s)
{
    kmp_free(s->pairs);
    kmp_free(s->table);
    kmp_free(s->met);
    kmp_free(s->member);
    s->pairs = NULL;
    s->table = NULL;
    s->met = s->member = NULL;
    s->pair_count = s->met_count = 0;
}

/* Counts the pairs of a list with an item from number `since` on, of items that another list may have; or all. */
static void count_of_list(sharing *s, list *l, uint32_t since)
{
    kmp_ref item[LONGEST];
    int count = 0;
    bool all = l->repeats;
    l->met = 0;
    for (int i = 0; i < l->count; i++) {
        const uint32_t id = kmp_id(s->items[l->first + i]);
        const bool alone = id < s->r->count && s->r->uses[id] == 1; /* no other list has it */
        if (all || !alone)
            item[count++] = s->items[l->first + i];
    }
    for (int i = 0; i < count; i++)
        for (int j = 0; j < i; j++) {
            kmp_ref a = item[i], b = item[j];
            if (!all && kmp_id(a) < since && kmp_id(b) < since)
                continue;
            order(&a, &b);
            int p = find(s, a, b);
            s->pairs[p].count++;
            s->met[s->met_count + l->met++] = p;
        }
    s->met_count += l->met;
}

static bool counts(const list *l, uint32_t since)
{
    return l->repeats || l->newest >= since;
}

/* False: no memory. */
static bool count_pairs(sharing *s, uint32_t since)
{
    int most = 0;
    for (int l = 0; l < s->list_count; l++)
        if (counts(&s->lists[l], since))
            most += s->lists[l].count * (s->lists[l].count - 1) / 2;
    /* Room for this number of pairs in lists; half of the table remains free. */
    const uint32_t least = 64;
    free_round(s);
    for (s->table_size = least; s->table_size / 2 <= (uint32_t)most;)
        s->table_size *= 2;
    s->table = KMP_NEW(uint32_t, s->table_size);
    s->pairs = kmp_realloc(NULL, (size_t)most, sizeof *s->pairs);
    s->met = kmp_realloc(NULL, (size_t)most, sizeof *s->met);
    if (!s->table || !s->pairs || !s->met)
        return false;
    for (int l = 0; l < s->list_count; l++)
        if (counts(&s->lists[l], since))
            count_of_list(s, &s->lists[l], since);
        else
            s->lists[l].met = 0;
    return true;
}

static int by_count(const void *x, const void *y)
{
    const pair *a = x, *b = y;
    if (a->count != b->count)
        return a->count > b->count ? -1 : 1;
    if (a->a != b->a)
        return a->a < b->a ? -1 : 1;
    return (a->b > b->b) - (a->b < b->b);
}

/* -- sharing ----------------------------------------------------------------------------------------- */

/* True if the pair occurs in a list, at positions `at`; *sign: of its first item there. */
static bool stands(const sharing *s, const list *l, const pair *p, int at[2], kmp_ref *sign)
{
    const kmp_ref *item = s->items + l->first;
    for (int i = 0; i < l->count; i++) {
        *sign = item[i] ^ p->a;
        for (int j = 0; *sign <= 1 && j < l->count; j++)
            if (i != j && item[j] == (p->b ^ *sign)) {
                at[0] = i < j ? i : j;
                at[1] = i < j ? j : i;
                return true;
            }
    }
    return false;
}

/* Puts the pair's replacement into all lists that still have it, if there are at least two. */
static bool share(sharing *s, const pair *p, const int *member)
{
    int at[2], found = 0;
    kmp_ref sign;
    for (int k = 0; k < p->count; k++)
        found += stands(s, &s->lists[member[k]], p, at, &sign);
    if (found < 2)
        return false;
    kmp_ref(*made)[2] = kmp_list_room(s->made, s->made_count, sizeof *made);
    if (!made) {
        s->failed = true;
        return false;
    }
    s->made = made;
    s->made[s->made_count][0] = p->a;
    s->made[s->made_count][1] = p->b;
    const uint32_t number = s->r->count + s->made_count++;
    for (int k = 0; k < p->count; k++) {
        list *l = &s->lists[member[k]];
        kmp_ref *item = s->items + l->first;
        if (!stands(s, l, p, at, &sign))
            continue;
        item[at[0]] = number << 1 | sign;
        memmove(item + at[1], item + at[1] + 1, (size_t)(l->count - at[1] - 1) * sizeof *item);
        l->count--;
        l->newest = number;
        l->changed = true;
    }
    return true;
}

/* One round, of pairs with an item from number `since` on; true if anything was shared. */
static bool share_all(sharing *s, uint32_t since)
{
    bool any = false;
    s->failed = !count_pairs(s, since);
    int members = 0;
    for (int k = 0; !s->failed && k < s->pair_count; k++) {
        s->pairs[k].first = s->pairs[k].count > 1 ? members : -1;
        members += s->pairs[k].count > 1 ? s->pairs[k].count : 0;
    }
    s->member = kmp_realloc(NULL, (size_t)members, sizeof *s->member);
    s->failed = s->failed || !s->member;
    if (!s->failed) {
        /* Lists the members of each pair that counts. */
        int met = 0;
        for (int l = 0; l < s->list_count; l++)
            for (int k = s->lists[l].met; k > 0; k--) {
                pair *p = &s->pairs[s->met[met++]];
                if (p->first >= 0)
                    s->member[p->first++] = l;
            }
        /* Pairs of two lists or more, the most frequent first; they are not found any more. */
        int count = 0;
        for (int k = 0; k < s->pair_count; k++)
            if (s->pairs[k].count > 1)
                s->pairs[count++] = s->pairs[k];
        s->pair_count = count;
        if (count)
            qsort(s->pairs, (size_t)count, sizeof *s->pairs, by_count);
    }
    for (int k = 0; k < s->pair_count && !s->failed; k++)
        any = share(s, &s->pairs[k], s->member + s->pairs[k].first - s->pairs[k].count) || any;
    return any;
}

/* -- the graph again --------------------------------------------------------------------------------- */

static kmp_ref combine(const sharing *s, kmp_ref a, kmp_ref b)
{
    return s->op == KMP_OP_ADD ? kmp_add(s->r->graph, a, b) : kmp_mul(s->r->graph, a, b);
}

static kmp_ref item_now(const sharing *s, kmp_ref item)
{
    uint32_t id = kmp_id(item);
    if (id < s->r->count)
        return kmp_rewritten(s->r, item);
    const kmp_ref *of = s->made[id - s->r->count];
    kmp_ref second = item_now(s, of[1]), r = combine(s, item_now(s, of[0]), second);
    return kmp_is_negative(item) ? kmp_neg(r) : r;
}

static void rebuild(sharing *s)
{
    kmp_graph *g = s->r->graph;
    int next = 0;
    for (uint32_t i = 0; i < s->r->live.top; i++) {
        uint32_t id = kmp_rewrite_live(s->r, i);
        bool head = next < s->list_count && s->lists[next].id == id;
        const list *l = head ? &s->lists[next++] : NULL;
        if (!l || !l->changed) {
            s->r->now[id] = kmp_rewrite_node(s->r, id);
            continue;
        }
        kmp_ref r = item_now(s, s->items[l->first]);
        for (int k = 1; k < l->count; k++)
            r = combine(s, r, item_now(s, s->items[l->first + k]));
        s->r->now[id] = r;
    }
    s->failed = s->failed || kmp_graph_failed(g);
}

static bool share_pairs(kmp_rewrite *r, kmp_op op, int count, kmp_ref *outputs)
{
    sharing s = {.r = r, .op = op};
    uint8_t *inside = KMP_ARENA_NEW(&s.room, uint8_t, r->count);
    s.lists = kmp_realloc(NULL, r->live.top, sizeof *s.lists);
    s.items = kmp_realloc(NULL, 2 * (size_t)r->live.top, sizeof *s.items);
    s.failed = s.room.failed || !s.lists || !s.items;
    if (!s.failed) {
        /* Sums (products) with a single reader that is of their kind: they are part of its list. */
        for (uint32_t i = 0; i < s.r->live.top; i++) {
            const kmp_node *n = kmp_graph_node(s.r->graph, kmp_rewrite_live(s.r, i));
            for (int k = 0; n->op == s.op && k < 2; k++) {
                uint32_t below = kmp_id(kmp_operand(n, k));
                inside[below] = s.r->uses[below] == 1 && kmp_graph_node(s.r->graph, below)->op == s.op;
            }
        }
        collect(&s, inside);
    }
    uint32_t since = 0, next = r->count;
    for (int pass = 0; pass < PASSES && !s.failed && share_all(&s, since); pass++) {
        since = next;
        next = r->count + s.made_count;
    }
    if (!s.failed)
        rebuild(&s);
    free_round(&s);
    kmp_arena_free(&s.room);
    kmp_free(s.lists);
    kmp_free(s.items);
    kmp_free(s.made);
    return !s.failed && kmp_rewrite_finish(r, 0, count, outputs);
}

bool kmp_share_sums(kmp_rewrite *r, const kmp_parallel *parallel, int count, kmp_ref *outputs)
{
    (void)parallel;
    return share_pairs(r, KMP_OP_ADD, count, outputs);
}

bool kmp_share_products(kmp_rewrite *r, const kmp_parallel *parallel, int count, kmp_ref *outputs)
{
    (void)parallel;
    return share_pairs(r, KMP_OP_MUL, count, outputs);
}
