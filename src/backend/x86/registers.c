/* SPDX-License-Identifier: BSD-3-Clause */
#include "backend/x86/registers.h"
#include <string.h>

#define NEVER UINT32_MAX

/* The state of writing. */
typedef struct writer {
    kmp_registers *r;
    kmp_x86 *c;
    uint32_t at; /* operation */
} writer;

bool kmp_registers_init(kmp_registers *r, kmp_arena *arena, uint32_t slots, uint32_t longest)
{
    *r = (kmp_registers){.next = KMP_ARENA_NEW(arena, uint32_t, slots),
                         .in = KMP_ARENA_NEW(arena, int8_t, slots),
                         .missing = KMP_ARENA_NEW(arena, uint8_t, slots),
                         .after = KMP_ARENA_NEW(arena, uint32_t, 2 * longest)};
    if (arena->failed)
        return false;
    memset(r->next, 0xff, slots * sizeof *r->next);
    memset(r->in, 0xff, slots * sizeof *r->in);
    return true;
}

static bool is_unary(uint8_t op)
{
    return op == KMP_X86_SQRT || op == KMP_X86_LOAD;
}

/* -- next uses --------------------------------------------------------------------------------------- */

/* Finds next uses from the end backwards; `next` is left with the first use of each slot. */
static void find_uses(kmp_registers *r, uint32_t count, const kmp_straight *operations)
{
    for (uint32_t k = count; k-- > 0;) {
        const kmp_straight *s = &operations[k];
        r->after[2 * k] = is_unary(s->op) ? NEVER : r->next[s->x];
        r->after[2 * k + 1] = r->next[s->y];
        if (!is_unary(s->op))
            r->next[s->x] = k;
        r->next[s->y] = k;
    }
}

/* -- registers --------------------------------------------------------------------------------------- */

static int32_t place(const writer *w, uint32_t slot)
{
    return (int32_t)(8 * (uint32_t)w->c->form * slot);
}

static void forget(kmp_registers *r, int reg)
{
    r->in[r->holds[reg] - 1] = -1;
    r->holds[reg] = 0;
    r->is_free |= 1u << reg;
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
    for (unsigned k = 0; k < KMP_X86_REGISTERS; k++) {
        uint64_t next = (uint64_t)r->until[k] << 8 | (KMP_X86_REGISTERS - k);
        next = (int)k == but ? 0 : next;
        furthest = next > furthest ? next : furthest;
    }
    return furthest >> 8 > than ? KMP_X86_REGISTERS - (int)(furthest & 255) : -1;
}

/* Frees the register: a value that memory has not got yet is stored, if it will be read. */
static void empty(writer *w, int reg)
{
    kmp_registers *r = w->r;
    if (!r->holds[reg])
        return;
    uint32_t slot = r->holds[reg] - 1;
    if (r->missing[slot] && r->next[slot] != NEVER) {
        kmp_x86_memory(w->c, KMP_X86_STORE, reg, 0, place(w, slot));
        r->missing[slot] = 0;
    }
    forget(r, reg);
}

static void hold(kmp_registers *r, int reg, uint32_t slot)
{
    r->holds[reg] = slot + 1;
    r->until[reg] = r->next[slot];
    r->is_free &= ~(1u << reg);
    r->in[slot] = (int8_t)reg;
}

static void load(writer *w, int reg, uint32_t slot)
{
    empty(w, reg);
    kmp_x86_memory(w->c, KMP_X86_LOAD, reg, 0, place(w, slot));
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
        kmp_x86_memory(w->c, KMP_X86_STORE, reg, 0, place(w, s->d));
    free_if_done(r, s->d);
}

static void apply(writer *w, kmp_x86_op op, int d, int x, uint32_t y, int y_register)
{
    if (y_register >= 0)
        kmp_x86_registers(w->c, op, d, x, y_register);
    else
        kmp_x86_memory(w->c, op, d, x, place(w, y));
}

static void write_unary(writer *w, const kmp_straight *s)
{
    kmp_registers *r = w->r;
    set_next(r, s->y, r->after[2 * w->at + 1]);
    int y = r->in[s->y];
    free_if_done(r, s->y);
    int d = find(w, -1, 0);
    empty(w, d);
    if (s->op == KMP_X86_SQRT || y < 0)
        apply(w, s->op, d, d, s->y, y);
    else if (d != y) /* from register to register: x + 0 would not keep -0 */
        kmp_x86_registers(w->c, KMP_X86_LOAD, d, d, y);
    finish(w, s, d);
}

static void write_binary(writer *w, const kmp_straight *s)
{
    kmp_registers *r = w->r;
    uint32_t x = s->x, y = s->y, after_x = r->after[2 * w->at], after_y = r->after[2 * w->at + 1];
    bool commutes = s->op == KMP_X86_ADD || s->op == KMP_X86_MUL;
    if (commutes && r->in[x] < 0 && (r->in[y] >= 0 || after_y < after_x)) {
        x = s->y;
        y = s->x;
        uint32_t after = after_x;
        after_x = after_y;
        after_y = after;
    }
    int first = first_source(w, x, r->in[y]);
    if (y != x)
        fetch(w, y, after_y, first);
    int second = r->in[y];
    set_next(r, x, after_x);
    set_next(r, y, after_y);
    free_if_done(r, x);
    free_if_done(r, y);
    int d = find(w, -1, 0);
    empty(w, d);
    apply(w, s->op, d, first, y, second);
    finish(w, s, d);
}

void kmp_registers_write(kmp_registers *r, kmp_x86 *c, uint32_t count, const kmp_straight *operations)
{
    writer w = {r, c, 0};
    find_uses(r, count, operations);
    r->is_free = (1u << KMP_X86_REGISTERS) - 1;
    for (; w.at < count; w.at++) {
        const kmp_straight *s = &operations[w.at];
        if (is_unary(s->op))
            write_unary(&w, s);
        else
            write_binary(&w, s);
    }
    for (int k = 0; k < KMP_X86_REGISTERS; k++)
        if (r->holds[k])
            forget(r, k);
    kmp_x86_return(c);
}
