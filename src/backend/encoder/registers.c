/* SPDX-License-Identifier: BSD-3-Clause */
/* Register allocation in one pass over straight-line code: next uses are known, so the value with the farthest one
 * leaves (Belady 1966). Values live in a register, in a place in memory, or in both; a store happens only if the value
 * is read again. */
#include "backend/encoder/registers.h"
#include <string.h>

#define NEVER UINT32_MAX

/* NEAR: a value that is read within this number of operations gets a place at a short distance, if there is one. BASED:
 * least number of operations of a piece of code that sets bases. */
enum { NEAR = 1500, BASED = 100 };

/* The state of writing. */
typedef struct writer {
    kmp_registers *r;
    kmp_written_code *c;
    const kmp_encoder *encoder;
    uint32_t at;    /* operation */
    uint32_t near;  /* places at short distances from bases */
    uint32_t reach; /* of these, from one base */
    int registers;
} writer;

bool kmp_registers_init(kmp_registers *r, kmp_arena *arena, uint32_t packs, uint32_t slots, uint32_t longest,
                        bool shared)
{
    *r = (kmp_registers){.slots = slots,
                         .packs = packs,
                         .places = shared ? 0 : KMP_PLACES,
                         .place = KMP_ARENA_NEW(arena, uint32_t, slots),
                         .next = KMP_ARENA_NEW(arena, uint32_t, slots),
                         .in = KMP_ARENA_NEW(arena, int16_t, slots),
                         .missing = KMP_ARENA_NEW(arena, uint8_t, slots),
                         .after = KMP_ARENA_NEW(arena, uint32_t, 3 * longest)};
    if (arena->failed)
        return false;
    memset(r->next, 0xff, slots * sizeof *r->next);
    memset(r->in, 0xff, slots * sizeof *r->in);
    return true;
}

static bool is_pair(const kmp_registers *r, uint32_t slot)
{
    return slot >= r->packs;
}

/* A load or a store of all of a value. */
static kmp_operation whole(const kmp_registers *r, kmp_operation op, uint32_t slot)
{
    return is_pair(r, slot) ? op | KMP_DO_PAIR : op;
}

/* -- memory ------------------------------------------------------------------------------------------ */

/* The first free place from `from` on, or the first of two; r->places if there is none. */
static uint32_t find_place(const kmp_registers *r, uint32_t from, bool pair)
{
    for (uint32_t word = from / 64; word < r->places / 64; word++) {
        uint64_t open = ~r->taken[word];
        open &= pair ? open >> 1 & UINT64_C(0x5555555555555555) : open;
        if (open)
            return 64 * word + (uint32_t)__builtin_ctzll(open);
    }
    return r->places;
}

static uint64_t bits_of(const kmp_registers *r, uint32_t slot, uint32_t place)
{
    return (uint64_t)(is_pair(r, slot) ? 3 : 1) << place % 64;
}

/* Gives a value that leaves its register a place, where there is one. */
static void take_place(const writer *w, uint32_t slot)
{
    kmp_registers *r = w->r;
    uint32_t place = find_place(r, r->next[slot] - w->at > NEAR ? w->near : 0, is_pair(r, slot));
    if (place >= r->places)
        return;
    r->taken[place / 64] |= bits_of(r, slot, place);
    r->place[slot] = place + 1;
    r->used = place + 2 > r->used ? place + 2 : r->used;
}

static void free_place_if_done(kmp_registers *r, uint32_t slot)
{
    uint32_t place = r->place[slot];
    if (place == 0 || r->next[slot] != NEVER)
        return;
    r->taken[(place - 1) / 64] &= ~bits_of(r, slot, place - 1);
    r->place[slot] = 0;
}

static int32_t bytes(const writer *w, uint32_t slots)
{
    return (int32_t)(8 * (uint32_t)kmp_code_lanes(w->c->form) * slots);
}

/* The place of a value, or of its lane. */
static kmp_code_address address_of(const writer *w, uint32_t slot, uint32_t lane)
{
    uint32_t place = w->r->place[slot];
    if (place == 0 && w->r->address)
        return w->r->address[slot];
    if (place == 0)
        return (kmp_code_address){0, bytes(w, slot + lane)};
    if (--place < w->near)
        return (kmp_code_address){1 + (int)(place / w->reach),
                                  bytes(w, place % w->reach + lane) - bytes(w, w->reach / 2)};
    return (kmp_code_address){0, bytes(w, w->r->slots + place + lane)};
}

static void use_memory(const writer *w, kmp_operation op, int d, int x, uint32_t slot, uint32_t lane)
{
    w->encoder->memory(w->c, op, d, x, address_of(w, slot, lane));
}

/* -- registers --------------------------------------------------------------------------------------- */

static uint32_t bit_of(int reg)
{
    return 1u << (reg & (KMP_CODE_REGISTERS - 1));
}

static void forget(kmp_registers *r, int reg)
{
    r->in[r->holds[reg] - 1] = -1;
    r->holds[reg] = 0;
    r->is_free |= bit_of(reg);
}

/* Notes the next use of a slot, which may be in a register. */
static void set_next(kmp_registers *r, uint32_t slot, uint32_t next)
{
    r->next[slot] = next;
    if (r->in[slot] >= 0)
        r->until[r->in[slot]] = next;
}

/* A free register, or the register of the value with the farthest next use, except `but`; -1: all of them are used
 * before `than`. */
static int find(const writer *w, int but, uint32_t than)
{
    const kmp_registers *r = w->r;
    if (r->is_free)
        return __builtin_ctz(r->is_free);
    uint64_t furthest = 0; /* next use, then the register, the first of equals */
    for (int k = 0; k < w->registers; k++) {
        uint64_t next = (uint64_t)r->until[k] << 8 | (unsigned)(KMP_CODE_REGISTERS - k);
        next = k == but ? 0 : next;
        furthest = next > furthest ? next : furthest;
    }
    return furthest >> 8 > than ? KMP_CODE_REGISTERS - (int)(furthest & 255) : -1;
}

/* Frees the register: a value that memory has not got yet is stored, if it will be read. */
static void empty(writer *w, int reg)
{
    kmp_registers *r = w->r;
    if (!r->holds[reg])
        return;
    uint32_t slot = r->holds[reg] - 1;
    if (r->missing[slot] && r->next[slot] != NEVER) {
        take_place(w, slot);
        use_memory(w, whole(r, KMP_DO_STORE, slot), reg, 0, slot, 0);
        r->missing[slot] = 0;
    }
    forget(r, reg);
}

static void hold(kmp_registers *r, int reg, uint32_t slot)
{
    r->holds[reg] = slot + 1;
    r->until[reg] = r->next[slot];
    r->is_free &= ~bit_of(reg);
    r->in[slot] = (int16_t)reg;
}

static void load(writer *w, int reg, uint32_t slot)
{
    empty(w, reg);
    use_memory(w, whole(w->r, KMP_DO_LOAD, slot), reg, 0, slot, 0);
    hold(w->r, reg, slot);
}

static void free_if_done(kmp_registers *r, uint32_t slot)
{
    if (r->in[slot] >= 0 && r->next[slot] == NEVER)
        forget(r, r->in[slot]);
}

/* -- operations -------------------------------------------------------------------------------------- */

/* A source that is used again soon is worth a register. */
static void fetch(writer *w, uint32_t slot, uint32_t again, int but)
{
    if (w->r->in[slot] >= 0 || again == NEVER)
        return;
    int reg = find(w, but, again);
    if (reg >= 0)
        load(w, reg, slot);
}

/* The first source has to be in a register. */
static int first_source(writer *w, uint32_t slot, int but)
{
    if (w->r->in[slot] < 0)
        load(w, find(w, but, 0), slot);
    return w->r->in[slot];
}

static void finish(writer *w, const kmp_straight *s, int reg)
{
    kmp_registers *r = w->r;
    hold(r, reg, s->d);
    r->missing[s->d] = !s->kept;
    if (s->kept)
        use_memory(w, KMP_DO_STORE, reg, 0, s->d, 0);
    const bool pair = s->low && s->high == s->low + 1;
    if (pair)
        use_memory(w, KMP_DO_STORE | KMP_DO_PAIR, reg, 0, s->low, 0);
    if (!pair && s->low)
        use_memory(w, KMP_DO_STORE, reg, 0, s->low, 0);
    if (!pair && s->high)
        use_memory(w, KMP_DO_STORE_HIGH, reg, 0, s->high, 0);
    free_if_done(r, s->d);
}

static void apply(writer *w, kmp_operation op, int d, int x, uint32_t y, int y_register)
{
    bool joins = op == KMP_DO_LOW_LOW || op == KMP_DO_LOW_HIGH;
    if (y_register >= 0)
        w->encoder->registers(w->c, op, d, x, y_register);
    else
        use_memory(w, joins ? KMP_DO_LOAD_HIGH : op, d, x, y, op == KMP_DO_LOW_HIGH);
}

static void write_unary(writer *w, const kmp_straight *s)
{
    kmp_registers *r = w->r;
    const bool copies = s->op == KMP_DO_LOAD || s->op == KMP_DO_HIGH;
    if (!copies && !w->encoder->reads_memory)
        (void)first_source(w, s->y, -1);
    set_next(r, s->y, r->after[3 * w->at + 1]);
    int y = r->in[s->y];
    free_if_done(r, s->y);
    int d = find(w, -1, 0);
    empty(w, d);
    if (s->op == KMP_DO_HIGH && y >= 0)
        w->encoder->registers(w->c, KMP_DO_HIGH_HIGH, d, y, y);
    else if (s->op == KMP_DO_HIGH)
        use_memory(w, KMP_DO_LOAD, d, 0, s->y, 1);
    else if (s->op != KMP_DO_LOAD || y < 0)
        apply(w, s->op, d, d, s->y, y);
    else if (d != y) /* from register to register: x + 0 would not keep -0 */
        w->encoder->registers(w->c, KMP_DO_LOAD, d, d, y);
    free_place_if_done(r, s->y);
    finish(w, s, d);
}

static void write_binary(writer *w, const kmp_straight *s)
{
    kmp_registers *r = w->r;
    uint32_t x = s->x, y = s->y, after_x = r->after[3 * w->at], after_y = r->after[3 * w->at + 1];
    if (kmp_operation_commutes(s->op) && r->in[x] < 0 && (r->in[y] >= 0 || after_y < after_x)) {
        x = s->y;
        y = s->x;
        uint32_t after = after_x;
        after_x = after_y;
        after_y = after;
    }
    int first = first_source(w, x, r->in[y]);
    if (y != x)
        fetch(w, y, after_y, first);
    const bool may_be_in_memory = w->encoder->reads_memory && s->op != KMP_DO_HIGH_LOW && s->op != KMP_DO_HIGH_HIGH;
    if (!may_be_in_memory && r->in[y] < 0)
        (void)first_source(w, y, first);
    int second = r->in[y];
    set_next(r, x, after_x);
    set_next(r, y, after_y);
    free_if_done(r, x);
    free_if_done(r, y);
    int d = find(w, -1, 0);
    empty(w, d);
    apply(w, s->op, d, first, y, second);
    free_place_if_done(r, x);
    free_place_if_done(r, y);
    finish(w, s, d);
}

/* A source of an operation of three: x, y or z. */
typedef struct source {
    uint32_t slot, after; /* its next use after the operation */
    int reg;              /* -1: it is in memory */
} source;

static int count_in_memory(const kmp_registers *r, const source *from)
{
    int count = 0;
    for (int k = 0; k < 3; k++)
        count += r->in[from[k].slot] < 0;
    return count;
}

/* The number of the source whose register receives the result: one that is not used again; one whose register is given
 * up, or that is in memory; otherwise the last one, which is copied. */
static int result_of(writer *w, source *from)
{
    const kmp_registers *r = w->r;
    int result = 2;
    for (int k = 0; k < 3; k++)
        if (from[k].reg >= 0 && r->in[from[k].slot] < 0)
            return k;
    int d = find(w, -1, 0);
    empty(w, d);
    for (int k = 0; k < 3; k++)
        result = from[k].reg < 0 ? k : result;
    for (int k = 0; k < 3; k++)
        result = from[k].reg == d ? k : result;
    if (from[result].reg < 0)
        use_memory(w, whole(r, KMP_DO_LOAD, from[result].slot), d, 0, from[result].slot, 0);
    else if (from[result].reg != d)
        w->encoder->registers(w->c, KMP_DO_LOAD | KMP_DO_PAIR, d, d, from[result].reg);
    from[result].reg = d;
    return result;
}

/* The register of the result where it replaces no source: the register of the summand, if free, since a sum of
 * pairs goes there; otherwise one that no factor has, if there is one. */
static int separate_result(writer *w, const source *from)
{
    const uint32_t others = w->r->is_free & ~(bit_of(from[0].reg) | bit_of(from[1].reg));
    const int summand = from[2].reg;
    const int d = w->r->is_free & bit_of(summand) ? summand : others ? __builtin_ctz(others) : find(w, -1, 0);
    empty(w, d);
    return d;
}

static void write_three(writer *w, const kmp_straight *s)
{
    kmp_registers *r = w->r;
    const uint32_t *after = &r->after[3 * w->at];
    source from[3] = {{s->x, after[0], -1}, {s->y, after[1], -1}, {s->z, after[2], -1}};
    const int in_memory = w->encoder->reads_memory ? 1 : 0; /* of the sources, at most; one that appears twice is not */
    for (int k = 0; k < 3; k++)
        fetch(w, from[k].slot, from[k].after, -1);
    for (int k = 0; k < 3 && count_in_memory(r, from) > in_memory; k++)
        (void)first_source(w, from[k].slot, -1);
    for (int k = 0; k < 3; k++)
        from[k].reg = r->in[from[k].slot];
    for (int k = 0; k < 3; k++)
        set_next(r, from[k].slot, from[k].after);
    for (int k = 0; k < 3; k++)
        free_if_done(r, from[k].slot);
    kmp_three_sources all = {0};
    if (w->encoder->reads_memory) {
        all.into = result_of(w, from);
        all.d = from[all.into].reg;
    } else {
        all.d = separate_result(w, from);
    }
    for (int k = 0; k < 3; k++) {
        all.from[k] = from[k].reg;
        if (from[k].reg < 0)
            all.at = address_of(w, from[k].slot, 0);
    }
    w->encoder->three(w->c, s->op, &all);
    for (int k = 0; k < 3; k++)
        free_place_if_done(r, from[k].slot);
    finish(w, s, all.d);
}

void kmp_registers_write(kmp_registers *r, kmp_written_code *c, uint32_t count, const kmp_straight *operations)
{
    const kmp_encoder *e = c->encoder;
    const uint32_t bases = (uint32_t)e->bases;
    writer w = {.r = r,
                .c = c,
                .encoder = e,
                .reach = bases > 1 ? (uint32_t)e->reach(c->form) : 0,
                .registers = e->register_count(c->form)};
    w.near = count < BASED || r->places == 0 ? 0 : (bases - 1) * w.reach;
    kmp_written_begin(c);
    /* Bases are in the middle of the places that they reach. */
    for (uint32_t base = 1; w.near > 0 && base < bases; base++)
        e->set_base(w.c, (int)base, bytes(&w, w.r->slots + (base - 1) * w.reach + w.reach / 2));
    /* Finds next uses from the end backwards; `next` is left with the first use of each slot. */
    for (uint32_t k = count; k-- > 0;) {
        const kmp_straight *s = &operations[k];
        bool unary = kmp_operation_is_unary(s->op), three = kmp_operation_has_three(s->op);
        r->after[3 * k] = unary ? NEVER : r->next[s->x];
        r->after[3 * k + 1] = r->next[s->y];
        r->after[3 * k + 2] = three ? r->next[s->z] : NEVER;
        if (!unary)
            r->next[s->x] = k;
        r->next[s->y] = k;
        if (three)
            r->next[s->z] = k;
    }
    r->is_free = (uint32_t)((UINT64_C(1) << w.registers) - 1);
    for (; w.at < count; w.at++) {
        const kmp_straight *s = &operations[w.at];
        if (kmp_operation_is_unary(s->op))
            write_unary(&w, s);
        else if (kmp_operation_has_three(s->op))
            write_three(&w, s);
        else
            write_binary(&w, s);
    }
    for (int k = 0; k < KMP_CODE_REGISTERS; k++)
        if (r->holds[k])
            forget(r, k);
    e->end(c);
}
