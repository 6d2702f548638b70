/* SPDX-License-Identifier: BSD-3-Clause */
/* Writes the operations of a piece with the chosen pairs. An operand that is no pack itself is joined from two values;
 * a value that is read alone is taken out of its pack. Each operation follows its operands; otherwise the order is
 * kept. */
#include "backend/x86/packs.h"
#include <string.h>

/* Pairs pay where they replace this part of the operations; and in longer pieces: where code is fetched from the second
 * cache, its length determines the time, in shorter ones the latency of the chain. */
#define WORTH 0.9
enum { LONG = 1500 };

/* An operand joined from two. */
typedef struct joint {
    uint32_t low, high, slot; /* slot 0: free */
} joint;

/* State of writing. */
typedef struct writer {
    kmp_packs *p;
    kmp_pack_choice c;
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

bool kmp_packs_init(kmp_packs *p, kmp_arena *arena, uint32_t slots, const double *values, uint32_t first, uint32_t end)
{
    *p = (kmp_packs){.arena = arena, .values = values, .first = first, .end = end};
    p->slots = p->next = slots + slots % 2;
    p->writer = KMP_ARENA_NEW(arena, uint32_t, slots);
    return p->writer;
}

static uint32_t new_slots(writer *w)
{
    w->p->next += 2;
    return w->p->next - 2;
}

static kmp_straight *append(writer *w, kmp_x86_op op, uint32_t d, uint32_t x, uint32_t y)
{
    uint32_t k = w->count < w->most ? w->count++ : w->most;
    w->out[k] = (kmp_straight){.op = (uint16_t)op, .d = d, .x = x, .y = y};
    return &w->out[k];
}

/* The operation that writes a slot, KMP_NO_OPERATION: it comes from elsewhere; of a pair, that of lane 0. */
static uint32_t operation_of(const writer *w, uint32_t slot)
{
    return w->c.writer[slot] - 1;
}

static uint32_t leader_of(const writer *w, uint32_t k)
{
    return k != KMP_NO_OPERATION && w->c.mate[k] != KMP_NO_OPERATION && w->c.lane[k] == 1 ? w->c.mate[k] : k;
}

static bool is_packed(const writer *w, uint32_t k)
{
    return k != KMP_NO_OPERATION && w->c.mate[k] != KMP_NO_OPERATION;
}

static bool is_constant(const writer *w, uint32_t slot)
{
    return slot >= w->p->first && slot < w->p->end;
}

/* -- operands ------------------------------------------------------------------------------------------ */

/* The place from which a value is read: its slot, or its pack and lane. */
static uint32_t place_of(const writer *w, uint32_t slot, int *lane)
{
    uint32_t k = operation_of(w, slot);
    *lane = is_packed(w, k) ? w->c.lane[k] : 0;
    return is_packed(w, k) ? w->pack[leader_of(w, k)] : slot;
}

/* The slot of a value that is read alone. */
static uint32_t read_alone(writer *w, uint32_t slot)
{
    int lane;
    uint32_t from = place_of(w, slot, &lane), k = operation_of(w, slot);
    if (lane == 0)
        return from;
    if (!w->alone[k])
        (void)append(w, KMP_X86_HIGH, slot, from, from);
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
    static const kmp_x86_op ops[2][2] = {{KMP_X86_LOW_LOW, KMP_X86_LOW_HIGH}, {KMP_X86_HIGH_LOW, KMP_X86_HIGH_HIGH}};
    int i, j;
    uint32_t x = place_of(w, low, &i), y = place_of(w, high, &j);
    if (is_constant(w, low) && is_constant(w, high))
        return add_constant(w, w->p->values[low], w->p->values[high]);
    bool twice = low == high && i == 0;
    return append(w, twice ? KMP_X86_TWICE : ops[i][j], new_slots(w), x, y)->d;
}

/* The slot of the pack of two values. */
static uint32_t read_both(writer *w, uint32_t low, uint32_t high)
{
    uint32_t a = operation_of(w, low);
    if (is_packed(w, a) && w->c.lane[a] == 0 && w->c.mate[a] == operation_of(w, high))
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
    bool unary = kmp_x86_is_unary(s->op);
    uint32_t x = unary ? 0 : read_alone(w, s->x), y = read_alone(w, s->y);
    uint32_t z = kmp_x86_has_three(s->op) ? read_alone(w, s->z) : 0;
    kmp_straight *out = append(w, s->op, s->d, x, y);
    out->z = z;
    out->kept = s->kept;
}

/* The negative of one lane of a pack. */
static uint32_t negate(writer *w, uint32_t slot, bool high)
{
    double low = high ? 0.0 : -0.0;
    return append(w, KMP_X86_XOR, new_slots(w), slot, add_constant(w, low, high ? -0.0 : 0.0))->d;
}

/* Sums and differences side by side. A lane that subtracts negates its second operand, unless the machine can do
 * both. */
static kmp_x86_op mix(writer *w, kmp_x86_op low, kmp_x86_op high, uint32_t *y)
{
    if (low == high)
        return low | KMP_X86_PAIR;
    if (!kmp_pack_negates(low, high))
        return KMP_X86_SUB_ADD;
    *y = negate(w, *y, true);
    return KMP_X86_ADD | KMP_X86_PAIR;
}

/* Operations of three sources side by side. A lane that subtracts its product negates a factor, unless both do. */
static kmp_x86_op mix_three(writer *w, kmp_x86_op low, kmp_x86_op high, uint32_t *y)
{
    if (low == high)
        return low | KMP_X86_PAIR;
    if (kmp_pack_negates(low, high)) {
        *y = negate(w, *y, high == KMP_X86_SUB_PRODUCT);
        low = low == KMP_X86_SUB_PRODUCT ? KMP_X86_PRODUCT_ADD : low;
        high = high == KMP_X86_SUB_PRODUCT ? KMP_X86_PRODUCT_ADD : high;
    }
    if (low == high)
        return low | KMP_X86_PAIR;
    return low == KMP_X86_PRODUCT_SUB ? KMP_X86_PRODUCT_SUB_ADD : KMP_X86_PRODUCT_ADD_SUB;
}

static void write_pair(writer *w, uint32_t k)
{
    const kmp_straight *s = &w->c.operations[k], *t = &w->c.operations[w->c.mate[k]];
    uint32_t turned, x = 0, y, z = 0;
    bool crossed = kmp_pack_is_crossed(&w->c, k, w->c.mate[k], &turned), first = crossed && turned == k;
    crossed = crossed && !first;
    if (!kmp_x86_is_unary(s->op))
        x = read_both(w, first ? s->y : s->x, crossed ? t->y : t->x);
    y = read_both(w, first ? s->x : s->y, crossed ? t->x : t->y);
    if (kmp_x86_has_three(s->op))
        z = read_both(w, s->z, t->z);
    kmp_x86_op op = kmp_x86_has_three(s->op) ? mix_three(w, s->op, t->op, &y) : mix(w, s->op, t->op, &y);
    w->pack[k] = new_slots(w);
    kmp_straight *out = append(w, op, w->pack[k], x, y);
    out->z = z;
    out->low = s->kept ? s->d : 0;
    out->high = t->kept ? t->d : 0;
}

static void expand(writer *w, uint32_t slot, uint32_t *pending)
{
    uint32_t k = leader_of(w, operation_of(w, slot));
    if (k != KMP_NO_OPERATION && w->state[k] == 0)
        w->pending[(*pending)++] = k;
}

static void expand_operands(writer *w, uint32_t k, uint32_t *pending)
{
    const kmp_straight *s = &w->c.operations[k];
    expand(w, s->y, pending);
    if (!kmp_x86_is_unary(s->op))
        expand(w, s->x, pending);
    if (kmp_x86_has_three(s->op))
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

static bool begin(writer *w, kmp_packs *p, uint32_t count, const kmp_straight *operations)
{
    *w = (writer){.p = p, .most = (uint32_t)(WORTH * count), .mask = 63};
    while (w->mask < count)
        w->mask = 2 * w->mask + 1;
    for (uint32_t k = 0; k < count; k++)
        p->writer[operations[k].d] = k + 1;
    KMP_ARENA_MAKE(p->arena, KMP_ROOM(joint, w->mask + 1, &w->joints), KMP_ROOM(kmp_straight, w->most + 1, &w->out),
                   KMP_ROOM(uint8_t, count, &w->state, &w->alone));
    return KMP_ARENA_EACH(p->arena, uint32_t, 4 * count, &w->pack, &w->pending) &&
           kmp_pack_choose(&w->c, p->arena, count, operations, p->writer);
}

bool kmp_packs_make(kmp_packs *p, uint32_t *count, const kmp_straight **operations)
{
    writer w;
    uint32_t next = p->next;
    int constants = p->constants;
    if (*count < LONG)
        return true;
    if (!begin(&w, p, *count, *operations))
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
