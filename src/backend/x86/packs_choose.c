/* SPDX-License-Identifier: BSD-3-Clause */
/* Operations of one shape are candidates: the same operations on operands of one shape, down to values from elsewhere.
 * From the highest shapes on, each operation tries some candidates; a trial pairs operands of both as deep as they fit.
 * Operations of one shape are equally high, so that none of a pair needs the other. */
#include "backend/x86/packs.h"

/* CANDIDATES: trials of an operation. The gain of a trial is counted in tenths of an operation. */
enum { CANDIDATES = 4, GAIN_PAIR = 10, LOSS_JOIN = 10, LOSS_SHARED = 3 };

/* A shape: its operation and the shapes of its operands. */
typedef struct shape {
    uint32_t op, x, y, z;
    uint32_t first, last; /* operations */
    uint32_t height;      /* of the expression */
    uint32_t lower;       /* the next shape of the same height */
} shape;

typedef struct shapes {
    shape *shape; /* from 1 on */
    uint32_t count;
    uint32_t *table, mask;     /* numbers by hash; 0: free */
    uint32_t height, *highest; /* the greatest; by height: the last shape of it */
} shapes;

static uint32_t operation_of(const kmp_pack_choice *c, uint32_t slot)
{
    return c->writer[slot] - 1; /* KMP_NO_OPERATION if there is none */
}

static uint32_t shape_of(const kmp_pack_choice *c, uint32_t slot)
{
    uint32_t k = operation_of(c, slot);
    return k == KMP_NO_OPERATION ? 0 : c->shape[k];
}

/* Sums and differences pair with each other. */
static kmp_x86_op kind_of(const kmp_straight *s)
{
    return kmp_x86_has_three(s->op) ? KMP_X86_PRODUCT_ADD : s->op == KMP_X86_SUB ? KMP_X86_ADD : s->op;
}

static bool is_unary(const kmp_straight *s)
{
    return s->op == KMP_X86_SQRT || s->op == KMP_X86_LOAD;
}

static bool commutes(const kmp_straight *s)
{
    return s->op == KMP_X86_ADD || s->op == KMP_X86_MUL || kmp_x86_has_three(s->op);
}

/* -- shapes -------------------------------------------------------------------------------------------- */

static uint32_t *find_shape(const shapes *all, const shape *asked)
{
    uint64_t hash = (asked->op * UINT64_C(31) + asked->x) * UINT64_C(0x9e3779b97f4a7c15) + asked->y;
    hash = hash * UINT64_C(0x94d049bb133111eb) + asked->z;
    uint32_t at = (uint32_t)((hash * UINT64_C(0xbf58476d1ce4e5b9)) >> 32) & all->mask;
    for (; all->table[at]; at = (at + 1) & all->mask) {
        const shape *s = &all->shape[all->table[at]];
        if (s->op == asked->op && s->x == asked->x && s->y == asked->y && s->z == asked->z)
            break;
    }
    return &all->table[at];
}

static uint32_t largest(uint32_t a, uint32_t b)
{
    return a > b ? a : b;
}

static void add_to_shape(kmp_pack_choice *c, shapes *all, uint32_t k)
{
    const kmp_straight *s = &c->operations[k];
    uint32_t x = is_unary(s) ? 0 : shape_of(c, s->x), y = shape_of(c, s->y);
    uint32_t z = kmp_x86_has_three(s->op) ? shape_of(c, s->z) : 0;
    bool turn = x > y && kind_of(s) != KMP_X86_DIV && !is_unary(s);
    shape asked = {.op = kind_of(s), .x = turn ? y : x, .y = turn ? x : y, .z = z, .first = k, .last = k};
    uint32_t *number = find_shape(all, &asked);
    if (*number == 0) {
        asked.height = 1 + largest(all->shape[x].height, largest(all->shape[y].height, all->shape[z].height));
        asked.lower = all->highest[asked.height];
        *number = ++all->count;
        all->shape[*number] = asked;
        all->highest[asked.height] = *number;
        all->height = asked.height > all->height ? asked.height : all->height;
    } else {
        c->next[all->shape[*number].last] = k;
        all->shape[*number].last = k;
    }
    c->next[k] = KMP_NO_OPERATION;
    c->shape[k] = *number;
}

static bool find_shapes(kmp_pack_choice *c, kmp_arena *arena, shapes *all)
{
    uint32_t size = 64;
    while (size < 2 * c->count)
        size *= 2;
    all->mask = size - 1;
    if (!KMP_ARENA_MAKE(arena, KMP_ROOM(uint32_t, size, &all->table), KMP_ROOM(shape, c->count + 1, &all->shape),
                        KMP_ROOM(uint32_t, c->count + 1, &all->highest)))
        return false;
    for (uint32_t k = 0; k < c->count; k++)
        add_to_shape(c, all, k);
    return true;
}

/* -- trials -------------------------------------------------------------------------------------------- */

static uint32_t mate_of(const kmp_pack_choice *c, uint32_t k)
{
    return c->stamp[k] == c->now ? c->trial[k] : c->mate[k];
}

static uint8_t lane_of(const kmp_pack_choice *c, uint32_t k)
{
    return c->stamp[k] == c->now ? c->side[k] : c->lane[k];
}

/* The merit of a pair of operands. */
static int fit(const kmp_pack_choice *c, uint32_t u, uint32_t v)
{
    uint32_t a = operation_of(c, u), b = operation_of(c, v);
    if (shape_of(c, u) != shape_of(c, v))
        return -100;
    if (a == KMP_NO_OPERATION)
        return u == v ? 2 : 1;
    if (a == b)
        return 1;
    if (mate_of(c, a) == b)
        return lane_of(c, a) == 0 ? 5 : 3;
    return mate_of(c, a) == KMP_NO_OPERATION && mate_of(c, b) == KMP_NO_OPERATION ? 2 : 0;
}

bool kmp_pack_is_crossed(const kmp_pack_choice *c, uint32_t a, uint32_t b, uint32_t *turned)
{
    const kmp_straight *s = &c->operations[a], *t = &c->operations[b];
    *turned = commutes(t) ? b : a;
    return !is_unary(s) && (commutes(s) || commutes(t)) &&
           fit(c, s->x, t->y) + fit(c, s->y, t->x) > fit(c, s->x, t->x) + fit(c, s->y, t->y);
}

bool kmp_pack_negates(kmp_x86_op low, kmp_x86_op high)
{
    return (low == KMP_X86_ADD && high == KMP_X86_SUB) ||
           (kmp_x86_has_three(low) && (low == KMP_X86_SUB_PRODUCT) != (high == KMP_X86_SUB_PRODUCT));
}

/* Pairs two operands on trial, if they can be; returns the gain. */
static int visit(kmp_pack_choice *c, uint32_t u, uint32_t v, uint32_t *pairs, uint32_t *pending)
{
    uint32_t a = operation_of(c, u), b = operation_of(c, v);
    if (u == v)
        return -LOSS_SHARED;
    if (a == KMP_NO_OPERATION && b == KMP_NO_OPERATION)
        return 0;
    if (a == KMP_NO_OPERATION || b == KMP_NO_OPERATION)
        return -LOSS_JOIN;
    if (mate_of(c, a) == b)
        return lane_of(c, a) == 0 ? 0 : -LOSS_JOIN;
    if (c->shape[a] != c->shape[b] || mate_of(c, a) != KMP_NO_OPERATION || mate_of(c, b) != KMP_NO_OPERATION)
        return -LOSS_JOIN;
    c->trial[a] = b;
    c->trial[b] = a;
    c->stamp[a] = c->stamp[b] = c->now;
    c->side[a] = 0;
    c->side[b] = 1;
    c->paired[2 * *pairs] = a;
    c->paired[2 * (*pairs)++ + 1] = b;
    c->pending[(*pending)++] = *pairs - 1;
    return kmp_pack_negates(c->operations[a].op, c->operations[b].op) ? GAIN_PAIR - LOSS_JOIN : GAIN_PAIR;
}

/* Pairs two operations and what they read. Returns the gain; *pairs: their number. */
static int try_pair(kmp_pack_choice *c, uint32_t a, uint32_t b, uint32_t *pairs)
{
    uint32_t pending = 0;
    c->now++;
    *pairs = 0;
    int gain = visit(c, c->operations[a].d, c->operations[b].d, pairs, &pending);
    while (pending > 0) {
        uint32_t pair = c->pending[--pending], turned, first = c->paired[2 * pair], second = c->paired[2 * pair + 1];
        const kmp_straight *s = &c->operations[first], *t = &c->operations[second];
        bool crossed = kmp_pack_is_crossed(c, first, second, &turned);
        if (!is_unary(s))
            gain += visit(c, s->x, crossed ? t->y : t->x, pairs, &pending);
        gain += visit(c, s->y, crossed ? t->x : t->y, pairs, &pending);
        if (kmp_x86_has_three(s->op))
            gain += visit(c, s->z, t->z, pairs, &pending);
    }
    return gain;
}

/* -- choice -------------------------------------------------------------------------------------------- */

/* The next operation of the shape without mate. Paths to it become short. */
static uint32_t next_alone(kmp_pack_choice *c, uint32_t k)
{
    uint32_t next = c->next[k];
    while (next != KMP_NO_OPERATION && c->mate[next] != KMP_NO_OPERATION)
        next = c->next[next];
    while (c->next[k] != next) {
        uint32_t after = c->next[k];
        c->next[k] = next;
        k = after;
    }
    return next;
}

/* Tries two operations in either order of lanes; *low and *high: the best pair so far. */
static void try_both(kmp_pack_choice *c, uint32_t a, uint32_t b, int *best, uint32_t *low, uint32_t *high)
{
    for (int order = 0; order < 2; order++) {
        uint32_t pairs, first = order ? b : a, second = order ? a : b;
        int gain = try_pair(c, first, second, &pairs);
        if (gain > *best) {
            *best = gain;
            *low = first;
            *high = second;
        }
    }
}

static void take_best(kmp_pack_choice *c, uint32_t k)
{
    int best = 0;
    uint32_t low = KMP_NO_OPERATION, high = low, pairs, other = next_alone(c, k);
    for (int trial = 0; trial < CANDIDATES && other != KMP_NO_OPERATION; trial++, other = next_alone(c, other))
        try_both(c, k, other, &best, &low, &high);
    if (low == KMP_NO_OPERATION)
        return;
    (void)try_pair(c, low, high, &pairs);
    for (uint32_t i = 0; i < 2 * pairs; i++) {
        c->mate[c->paired[i]] = c->trial[c->paired[i]];
        c->lane[c->paired[i]] = c->side[c->paired[i]];
    }
}

bool kmp_pack_choose(kmp_pack_choice *c, kmp_arena *arena, uint32_t count, const kmp_straight *operations,
                     const uint32_t *writer)
{
    shapes all = {0};
    *c = (kmp_pack_choice){.count = count, .operations = operations, .writer = writer};
    KMP_ARENA_EACH(arena, uint8_t, count, &c->lane, &c->side);
    KMP_ARENA_EACH(arena, uint32_t, count, &c->mate, &c->shape, &c->next, &c->trial, &c->stamp, &c->paired,
                   &c->pending);
    if (arena->failed || !find_shapes(c, arena, &all))
        return false;
    for (uint32_t k = 0; k < count; k++)
        c->mate[k] = KMP_NO_OPERATION;
    for (uint32_t height = all.height; height > 0; height--)
        for (uint32_t number = all.highest[height]; number > 0; number = all.shape[number].lower)
            for (uint32_t k = all.shape[number].first; k != KMP_NO_OPERATION; k = c->next[k])
                if (c->mate[k] == KMP_NO_OPERATION && operations[k].op != KMP_X86_LOAD)
                    take_best(c, k);
    c->now++;
    return true;
}
