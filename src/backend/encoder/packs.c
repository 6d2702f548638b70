/* SPDX-License-Identifier: BSD-3-Clause */
/* Writes the operations of a piece with the chosen pairs. An operand that is not a pack itself is joined from two
 * values; a value that is read separately is taken out of its pack. Each operation follows its operands; otherwise the
 * order is kept. */
#include "backend/encoder/packs.h"
#include <string.h>

/* Pairs pay where they replace this part of the operations; and in longer pieces: where code is fetched from the second
 * cache, its length determines the time, in shorter ones the latency of the chain. */
#define WORTH 0.9
enum { LONG = 1500 };

#define NO_OPERATION UINT32_MAX

/* The operations of a piece of code, and which of them go together. */
typedef struct pack_choice {
    uint32_t count;
    const kmp_straight *operations;
    const uint32_t *writer; /* by slot: the operation that writes it, + 1; 0: none */
    uint32_t *mate;         /* by operation: the other one; NO_OPERATION: it stays separate */
    uint8_t *lane;          /* its lane: 0 or 1 */
    /* of the search: */
    uint32_t *shape;   /* by operation: number of its shape, from 1 on; values from elsewhere have shape 0 */
    uint32_t *next;    /* by operation: the next one of its shape that may be without mate */
    uint32_t *trial;   /* by operation: its mate on trial */
    uint32_t *stamp;   /* the trial that this belongs to */
    uint8_t *side;     /* its lane there */
    uint32_t now;      /* number of the trial */
    uint32_t *paired;  /* operations of the trial, in pairs */
    uint32_t *pending; /* pairs to be visited */
} pack_choice;

/* -- the choice of pairs -------------------------------------------------------------------------------- */

/* Operations of one shape are candidates: the same operations on operands of one shape, down to values from elsewhere.
 * From the highest shapes on, each operation tries some candidates; a trial pairs operands of both as deep as they fit.
 * Operations of one shape are equally high, so that none of a pair needs the other. */

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

static uint32_t operation_of(const pack_choice *c, uint32_t slot)
{
    return c->writer[slot] - 1; /* NO_OPERATION if there is none */
}

static uint32_t shape_of(const pack_choice *c, uint32_t slot)
{
    uint32_t k = operation_of(c, slot);
    return k == NO_OPERATION ? 0 : c->shape[k];
}

/* Sums and differences pair with each other. */
static kmp_operation kind_of(const kmp_straight *s)
{
    return kmp_operation_has_three(s->op) ? KMP_DO_PRODUCT_ADD : s->op == KMP_DO_SUB ? KMP_DO_ADD : s->op;
}

static bool is_unary(const kmp_straight *s)
{
    return s->op == KMP_DO_SQRT || s->op == KMP_DO_LOAD;
}

static bool commutes(const kmp_straight *s)
{
    return s->op == KMP_DO_ADD || s->op == KMP_DO_MUL || kmp_operation_has_three(s->op);
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

static void add_to_shape(pack_choice *c, shapes *all, uint32_t k)
{
    const kmp_straight *s = &c->operations[k];
    uint32_t x = is_unary(s) ? 0 : shape_of(c, s->x), y = shape_of(c, s->y);
    uint32_t z = kmp_operation_has_three(s->op) ? shape_of(c, s->z) : 0;
    bool turn = x > y && kind_of(s) != KMP_DO_DIV && !is_unary(s);
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
    c->next[k] = NO_OPERATION;
    c->shape[k] = *number;
}

static bool find_shapes(pack_choice *c, kmp_arena *arena, shapes *all)
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

static uint32_t mate_of(const pack_choice *c, uint32_t k)
{
    return c->stamp[k] == c->now ? c->trial[k] : c->mate[k];
}

static uint8_t lane_of(const pack_choice *c, uint32_t k)
{
    return c->stamp[k] == c->now ? c->side[k] : c->lane[k];
}

/* The merit of a pair of operands. */
static int fit(const pack_choice *c, uint32_t u, uint32_t v)
{
    uint32_t a = operation_of(c, u), b = operation_of(c, v);
    if (shape_of(c, u) != shape_of(c, v))
        return -100;
    if (a == NO_OPERATION)
        return u == v ? 2 : 1;
    if (a == b)
        return 1;
    if (mate_of(c, a) == b)
        return lane_of(c, a) == 0 ? 5 : 3;
    return mate_of(c, a) == NO_OPERATION && mate_of(c, b) == NO_OPERATION ? 2 : 0;
}

static bool pack_is_crossed(const pack_choice *c, uint32_t a, uint32_t b, uint32_t *turned)
{
    const kmp_straight *s = &c->operations[a], *t = &c->operations[b];
    *turned = commutes(t) ? b : a;
    return !is_unary(s) && (commutes(s) || commutes(t)) &&
           fit(c, s->x, t->y) + fit(c, s->y, t->x) > fit(c, s->x, t->x) + fit(c, s->y, t->y);
}

static bool pack_negates(kmp_operation low, kmp_operation high)
{
    return (low == KMP_DO_ADD && high == KMP_DO_SUB) ||
           (kmp_operation_has_three(low) && (low == KMP_DO_SUB_PRODUCT) != (high == KMP_DO_SUB_PRODUCT));
}

/* Pairs two operands on trial, if they can be; returns the gain. */
static int visit(pack_choice *c, uint32_t u, uint32_t v, uint32_t *pairs, uint32_t *pending)
{
    uint32_t a = operation_of(c, u), b = operation_of(c, v);
    if (u == v)
        return -LOSS_SHARED;
    if (a == NO_OPERATION && b == NO_OPERATION)
        return 0;
    if (a == NO_OPERATION || b == NO_OPERATION)
        return -LOSS_JOIN;
    if (mate_of(c, a) == b)
        return lane_of(c, a) == 0 ? 0 : -LOSS_JOIN;
    if (c->shape[a] != c->shape[b] || mate_of(c, a) != NO_OPERATION || mate_of(c, b) != NO_OPERATION)
        return -LOSS_JOIN;
    c->trial[a] = b;
    c->trial[b] = a;
    c->stamp[a] = c->stamp[b] = c->now;
    c->side[a] = 0;
    c->side[b] = 1;
    c->paired[2 * *pairs] = a;
    c->paired[2 * (*pairs)++ + 1] = b;
    c->pending[(*pending)++] = *pairs - 1;
    return pack_negates(c->operations[a].op, c->operations[b].op) ? GAIN_PAIR - LOSS_JOIN : GAIN_PAIR;
}

/* Pairs two operations and what they read. Returns the gain; *pairs: their number. */
static int try_pair(pack_choice *c, uint32_t a, uint32_t b, uint32_t *pairs)
{
    uint32_t pending = 0;
    c->now++;
    *pairs = 0;
    int gain = visit(c, c->operations[a].d, c->operations[b].d, pairs, &pending);
    while (pending > 0) {
        uint32_t pair = c->pending[--pending], turned, first = c->paired[2 * pair], second = c->paired[2 * pair + 1];
        const kmp_straight *s = &c->operations[first], *t = &c->operations[second];
        bool crossed = pack_is_crossed(c, first, second, &turned);
        if (!is_unary(s))
            gain += visit(c, s->x, crossed ? t->y : t->x, pairs, &pending);
        gain += visit(c, s->y, crossed ? t->x : t->y, pairs, &pending);
        if (kmp_operation_has_three(s->op))
            gain += visit(c, s->z, t->z, pairs, &pending);
    }
    return gain;
}

/* -- choice -------------------------------------------------------------------------------------------- */

/* The next operation of the shape without mate. Paths to it become short. */
static uint32_t next_alone(pack_choice *c, uint32_t k)
{
    uint32_t next = c->next[k];
    while (next != NO_OPERATION && c->mate[next] != NO_OPERATION)
        next = c->next[next];
    while (c->next[k] != next) {
        uint32_t after = c->next[k];
        c->next[k] = next;
        k = after;
    }
    return next;
}

/* Tries two operations in either order of lanes; *low and *high: the best pair so far. */
static void try_both(pack_choice *c, uint32_t a, uint32_t b, int *best, uint32_t *low, uint32_t *high)
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

static void take_best(pack_choice *c, uint32_t k)
{
    int best = 0;
    uint32_t low = NO_OPERATION, high = low, pairs, other = next_alone(c, k);
    for (int trial = 0; trial < CANDIDATES && other != NO_OPERATION; trial++, other = next_alone(c, other))
        try_both(c, k, other, &best, &low, &high);
    if (low == NO_OPERATION)
        return;
    (void)try_pair(c, low, high, &pairs);
    for (uint32_t i = 0; i < 2 * pairs; i++) {
        c->mate[c->paired[i]] = c->trial[c->paired[i]];
        c->lane[c->paired[i]] = c->side[c->paired[i]];
    }
}

/* Chooses the pairs; mate and lane are the results, in the arena. False: no memory. */
static bool pack_choose(pack_choice *c, kmp_arena *arena, uint32_t count, const kmp_straight *operations,
                        const uint32_t *writer)
{
    shapes all = {0};
    *c = (pack_choice){.count = count, .operations = operations, .writer = writer};
    KMP_ARENA_EACH(arena, uint8_t, count, &c->lane, &c->side);
    KMP_ARENA_EACH(arena, uint32_t, count, &c->mate, &c->shape, &c->next, &c->trial, &c->stamp, &c->paired,
                   &c->pending);
    if (arena->failed || !find_shapes(c, arena, &all))
        return false;
    for (uint32_t k = 0; k < count; k++)
        c->mate[k] = NO_OPERATION;
    for (uint32_t height = all.height; height > 0; height--)
        for (uint32_t number = all.highest[height]; number > 0; number = all.shape[number].lower)
            for (uint32_t k = all.shape[number].first; k != NO_OPERATION; k = c->next[k])
                if (c->mate[k] == NO_OPERATION && operations[k].op != KMP_DO_LOAD)
                    take_best(c, k);
    c->now++;
    return true;
}

/* -- writing ------------------------------------------------------------------------------------------- */

/* An operand joined from two. */
typedef struct joint {
    uint32_t low, high, slot; /* slot 0: free */
} joint;

/* State of writing. */
typedef struct writer {
    kmp_packs *p;
    pack_choice c;
    kmp_straight *out;
    uint32_t count, most; /* with more pairs do not pay */
    uint8_t *state;       /* by operation: 0, EXPANDED, WRITTEN */
    uint8_t *alone;       /* by operation: its value is taken out of its pack */
    uint32_t *pack;       /* by operation of lane 0: the slot of the pack */
    uint32_t *pending;    /* operations to be written */
    joint *joints;
    uint32_t mask;
} writer;

enum { EXPANDED = 1, WRITTEN };

bool kmp_packs_init(kmp_packs *p, kmp_arena *arena, const kmp_encoder *encoder, uint32_t slots, const double *values,
                    uint32_t first, uint32_t end)
{
    *p = (kmp_packs){.arena = arena, .encoder = encoder, .values = values, .first = first, .end = end};
    p->slots = p->next = slots + slots % 2;
    p->writer = KMP_ARENA_NEW(arena, uint32_t, slots);
    return p->writer;
}

static uint32_t new_slots(writer *w)
{
    w->p->next += 2;
    return w->p->next - 2;
}

static kmp_straight *append(writer *w, kmp_operation op, uint32_t d, uint32_t x, uint32_t y)
{
    uint32_t k = w->count < w->most ? w->count++ : w->most;
    w->out[k] = (kmp_straight){.op = (uint16_t)op, .d = d, .x = x, .y = y};
    return &w->out[k];
}

static uint32_t leader_of(const writer *w, uint32_t k)
{
    return k != NO_OPERATION && w->c.mate[k] != NO_OPERATION && w->c.lane[k] == 1 ? w->c.mate[k] : k;
}

static bool is_packed(const writer *w, uint32_t k)
{
    return k != NO_OPERATION && w->c.mate[k] != NO_OPERATION;
}

static bool is_constant(const writer *w, uint32_t slot)
{
    return slot >= w->p->first && slot < w->p->end;
}

/* -- operands ------------------------------------------------------------------------------------------ */

/* The place from which a value is read: its slot, or its pack and lane. */
static uint32_t place_of(const writer *w, uint32_t slot, int *lane)
{
    uint32_t k = operation_of(&w->c, slot);
    *lane = is_packed(w, k) ? w->c.lane[k] : 0;
    return is_packed(w, k) ? w->pack[leader_of(w, k)] : slot;
}

/* The slot of a value that is read separately. */
static uint32_t read_alone(writer *w, uint32_t slot)
{
    int lane;
    uint32_t from = place_of(w, slot, &lane), k = operation_of(&w->c, slot);
    if (lane == 0)
        return from;
    if (!w->alone[k])
        (void)append(w, KMP_DO_HIGH, slot, from, from);
    w->alone[k] = 1;
    return slot;
}

static uint32_t add_constant(writer *w, double low, double high)
{
    kmp_packs *p = w->p;
    kmp_pack_constant *list = kmp_arena_room(p->arena, p->constant, p->constants, sizeof *list);
    uint32_t slot = new_slots(w);
    if (list) {
        p->constant = list;
        list[p->constants++] = (kmp_pack_constant){slot, {low, high}};
    }
    return slot;
}

static uint32_t join(writer *w, uint32_t low, uint32_t high)
{
    static const kmp_operation ops[2][2] = {{KMP_DO_LOW_LOW, KMP_DO_LOW_HIGH}, {KMP_DO_HIGH_LOW, KMP_DO_HIGH_HIGH}};
    int i, j;
    uint32_t x = place_of(w, low, &i), y = place_of(w, high, &j);
    if (is_constant(w, low) && is_constant(w, high))
        return add_constant(w, w->p->values[low], w->p->values[high]);
    bool twice = low == high && i == 0;
    return append(w, twice ? KMP_DO_TWICE : ops[i][j], new_slots(w), x, y)->d;
}

/* The slot of the pack of two values. */
static uint32_t read_both(writer *w, uint32_t low, uint32_t high)
{
    uint32_t a = operation_of(&w->c, low);
    if (is_packed(w, a) && w->c.lane[a] == 0 && w->c.mate[a] == operation_of(&w->c, high))
        return w->pack[a];
    uint32_t at = (low * UINT32_C(2654435761) ^ high * UINT32_C(2246822519)) >> 7 & w->mask;
    while (w->joints[at].slot && (w->joints[at].low != low || w->joints[at].high != high))
        at = (at + 1) & w->mask;
    if (!w->joints[at].slot)
        w->joints[at] = (joint){low, high, join(w, low, high)};
    return w->joints[at].slot;
}

/* -- operations ---------------------------------------------------------------------------------------- */

static void write_alone(writer *w, const kmp_straight *s)
{
    bool unary = kmp_operation_is_unary(s->op);
    uint32_t x = unary ? 0 : read_alone(w, s->x), y = read_alone(w, s->y);
    uint32_t z = kmp_operation_has_three(s->op) ? read_alone(w, s->z) : 0;
    kmp_straight *out = append(w, s->op, s->d, x, y);
    out->z = z;
    out->kept = s->kept;
}

/* The negative of one lane of a pack. */
static uint32_t negate(writer *w, uint32_t slot, bool high)
{
    double low = high ? 0.0 : -0.0;
    return append(w, KMP_DO_XOR, new_slots(w), slot, add_constant(w, low, high ? -0.0 : 0.0))->d;
}

/* Sums and differences side by side. A lane that subtracts negates its second operand, unless the machine can do
 * both. */
static kmp_operation mix(writer *w, kmp_operation low, kmp_operation high, uint32_t *y)
{
    if (low == high)
        return low | KMP_DO_PAIR;
    if (!pack_negates(low, high) && w->p->encoder->mixes_pairs)
        return KMP_DO_SUB_ADD;
    *y = negate(w, *y, high == KMP_DO_SUB);
    return KMP_DO_ADD | KMP_DO_PAIR;
}

/* Operations of three sources side by side. A lane that subtracts its product negates a factor, unless both do. A lane
 * that subtracts its summand negates that, unless both do or the machine can do both. */
static kmp_operation mix_three(writer *w, kmp_operation low, kmp_operation high, uint32_t *y, uint32_t *z)
{
    if (low == high)
        return low | KMP_DO_PAIR;
    if (pack_negates(low, high)) {
        *y = negate(w, *y, high == KMP_DO_SUB_PRODUCT);
        low = low == KMP_DO_SUB_PRODUCT ? KMP_DO_PRODUCT_ADD : low;
        high = high == KMP_DO_SUB_PRODUCT ? KMP_DO_PRODUCT_ADD : high;
    }
    if (low == high)
        return low | KMP_DO_PAIR;
    if (w->p->encoder->mixes_pairs)
        return low == KMP_DO_PRODUCT_SUB ? KMP_DO_PRODUCT_SUB_ADD : KMP_DO_PRODUCT_ADD_SUB;
    *z = negate(w, *z, high == KMP_DO_PRODUCT_SUB);
    return KMP_DO_PRODUCT_ADD | KMP_DO_PAIR;
}

static void write_pair(writer *w, uint32_t k)
{
    const kmp_straight *s = &w->c.operations[k], *t = &w->c.operations[w->c.mate[k]];
    uint32_t turned, x = 0, y, z = 0;
    bool crossed = pack_is_crossed(&w->c, k, w->c.mate[k], &turned), first = crossed && turned == k;
    crossed = crossed && !first;
    if (!kmp_operation_is_unary(s->op))
        x = read_both(w, first ? s->y : s->x, crossed ? t->y : t->x);
    y = read_both(w, first ? s->x : s->y, crossed ? t->x : t->y);
    if (kmp_operation_has_three(s->op))
        z = read_both(w, s->z, t->z);
    kmp_operation op = kmp_operation_has_three(s->op) ? mix_three(w, s->op, t->op, &y, &z) : mix(w, s->op, t->op, &y);
    w->pack[k] = new_slots(w);
    kmp_straight *out = append(w, op, w->pack[k], x, y);
    out->z = z;
    out->low = s->kept ? s->d : 0;
    out->high = t->kept ? t->d : 0;
}

static void expand(writer *w, uint32_t slot, uint32_t *pending)
{
    uint32_t k = leader_of(w, operation_of(&w->c, slot));
    if (k != NO_OPERATION && w->state[k] == 0)
        w->pending[(*pending)++] = k;
}

static void expand_operands(writer *w, uint32_t k, uint32_t *pending)
{
    const kmp_straight *s = &w->c.operations[k];
    expand(w, s->y, pending);
    if (!kmp_operation_is_unary(s->op))
        expand(w, s->x, pending);
    if (kmp_operation_has_three(s->op))
        expand(w, s->z, pending);
}

/* Writes an operation after all that it needs. */
static void write_with_operands(writer *w, uint32_t k)
{
    uint32_t pending = 0;
    w->pending[pending++] = k;
    while (pending > 0) {
        k = w->pending[pending - 1];
        if (w->state[k] == 0) {
            w->state[k] = EXPANDED;
            if (is_packed(w, k))
                expand_operands(w, w->c.mate[k], &pending);
            expand_operands(w, k, &pending);
            continue;
        }
        pending--;
        if (w->state[k] == WRITTEN)
            continue;
        w->state[k] = WRITTEN;
        if (is_packed(w, k))
            write_pair(w, k);
        else
            write_alone(w, &w->c.operations[k]);
    }
}

bool kmp_packs_make(kmp_packs *p, uint32_t *count, const kmp_straight **operations)
{
    uint32_t next = p->next;
    int constants = p->constants;
    if (*count < LONG)
        return true;
    writer w = {.p = p, .most = (uint32_t)(WORTH * *count), .mask = 63};
    while (w.mask < *count)
        w.mask = 2 * w.mask + 1;
    for (uint32_t k = 0; k < *count; k++)
        p->writer[(*operations)[k].d] = k + 1;
    KMP_ARENA_MAKE(p->arena, KMP_ROOM(joint, w.mask + 1, &w.joints), KMP_ROOM(kmp_straight, w.most + 1, &w.out),
                   KMP_ROOM(uint8_t, *count, &w.state, &w.alone));
    if (!KMP_ARENA_EACH(p->arena, uint32_t, 4 * *count, &w.pack, &w.pending) ||
        !pack_choose(&w.c, p->arena, *count, *operations, p->writer))
        return false;
    for (uint32_t k = 0; k < *count; k++)
        if (leader_of(&w, k) == k)
            write_with_operands(&w, k);
    for (uint32_t k = 0; k < *count; k++)
        p->writer[(*operations)[k].d] = 0;
    if (w.count == w.most) {
        p->next = next;
        p->constants = constants;
        return !p->arena->failed;
    }
    *count = w.count;
    *operations = w.out;
    return !p->arena->failed;
}
