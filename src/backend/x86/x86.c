/* SPDX-License-Identifier: BSD-3-Clause */
/* Encoding of instructions: prefix, opcode, registers or an address with the shortest distance. Code goes to pages that
 * are first written, then executed, never both at once. */
#include "backend/x86/x86.h"
#include "base/clones.h"
#include "base/memory.h"
#include <string.h>

enum { LONGEST = 16, SHORT = 128 /* least and, but one, greatest distance in a byte */ };

/* rdi, then registers whose number needs no prefix: rsi, rdx, rcx, rax, which a function may overwrite; and rbx, rbp,
 * from SAVED on, which it has to restore. */
static const int base_register[KMP_X86_BASES] = {7, 6, 2, 1, 0, 3, 5};
enum { SAVED = 5 };
/* The second of two registers: its number after the number of the first one; its place in memory. */
static int second_register(kmp_x86_form form)
{
    return kmp_x86_has_eights(form) ? 16 : 8;
}
/* Room for one more instruction. */
static uint8_t *room(kmp_x86 *c)
{
    if (c->size + LONGEST > c->capacity) {
        size_t capacity = c->capacity ? 2 * c->capacity : c->expected + 4096;
        uint8_t *code = c->failed ? NULL : kmp_realloc(c->code, capacity, 1);
        if (!code) {
            c->failed = true;
            return NULL;
        }
        c->code = code;
        c->capacity = capacity;
    }
    return c->code + c->size;
}

static uint8_t *put(uint8_t *at, int byte)
{
    *at = (uint8_t)byte;
    return at + 1;
}

static uint8_t *put_32(uint8_t *at, int32_t x)
{
    uint32_t u = (uint32_t)x;
    for (int k = 0; k < 4; k++, u >>= 8)
        at = put(at, (int)(u & 255));
    return at;
}

/* Ends an instruction. */
static void finish(kmp_x86 *c, const uint8_t *end)
{
    c->size = (size_t)(end - c->code);
}

static bool is_packed(kmp_x86_form form, kmp_x86_op op)
{
    return form != KMP_X86_ONE || op & KMP_X86_PAIR;
}

/* Loads and stores have no second source; a packed square root has none either. */
static bool has_source(kmp_x86_form form, kmp_x86_op op)
{
    kmp_x86_op single = kmp_x86_single(op);
    return single != KMP_X86_LOAD && single != KMP_X86_STORE && op != KMP_X86_TWICE && op != KMP_X86_STORE_HIGH &&
           !(single == KMP_X86_SQRT && is_packed(form, op));
}

/* Prefix for registers d (ModRM.reg), x (vvvv) and y (ModRM.rm), followed by the opcode. Bits of registers are
 * inverted. Operations of three sources are in the second table of opcodes, 0f 38, with W = 1. */
static inline uint8_t *put_prefix(uint8_t *at, kmp_x86_form form, kmp_x86_op op, int d, int x, int y)
{
    int r = !(d & 8), b = !(y & 8), source = has_source(form, op) ? ~x & 31 : 31, v = source & 15;
    bool three = kmp_x86_has_three(op);
    int wide = form != KMP_X86_ONE, pp = three || is_packed(form, op) ? 1 : 3, table = three ? 2 : 1;
    if (kmp_x86_has_eights(form)) {
        at = put(at, 0x62);
        at = put(at, r << 7 | (y < 16) << 6 | b << 5 | (d < 16) << 4 | table);
        at = put(at, 1 << 7 | v << 3 | 1 << 2 | pp);
        at = put(at, 2 << 5 | source >> 4 << 3);
    } else if (b && !three) {
        at = put(at, 0xc5);
        at = put(at, r << 7 | v << 3 | wide << 2 | pp);
    } else {
        at = put(at, 0xc4);
        at = put(at, r << 7 | 1 << 6 | b << 5 | table);
        at = put(at, (three ? 1 << 7 : 0) | v << 3 | wide << 2 | pp);
    }
    return put(at, (int)op & 255);
}

static uint8_t *put_bits(uint8_t *at, kmp_x86_op op)
{
    return op >> 12 ? put(at, (int)op >> 12) : at;
}

static inline void put_registers(kmp_x86 *c, kmp_x86_form form, kmp_x86_op op, int d, int x, int y)
{
    uint8_t *at = room(c);
    if (!at)
        return;
    if (kmp_x86_commutes(op) && x < 8 && y >= 8) { /* a byte less */
        int z = x;
        x = y;
        y = z;
    }
    at = put_prefix(at, form, op, d, x, y);
    at = put(at, 3 << 6 | (d & 7) << 3 | (y & 7));
    finish(c, put_bits(at, op));
}

/* Most code is of the form of one double. */
void kmp_x86_registers(kmp_x86 *c, kmp_x86_op op, int d, int x, int y)
{
    if (c->form == KMP_X86_ONE) {
        put_registers(c, KMP_X86_ONE, op, d, x, y);
        return;
    }
    put_registers(c, c->form, op, d, x, y);
    int second = second_register(c->form);
    if (c->form & KMP_X86_TWO)
        put_registers(c, c->form, op, d + second, x + second, y + second);
}

/* Opcodes 98, a8 and b8 to 9d, ad and bd, odd for a single double; 96 and 97, a6 .. for pairs that differ in sign. */
static kmp_x86_op ordered(kmp_x86_form form, kmp_x86_op op, kmp_x86_order order)
{
    static const unsigned bits[] = {0x90, 0xa0, 0xb0};
    return (kmp_x86_op)((unsigned)op | bits[order] | !is_packed(form, op));
}

void kmp_x86_three(kmp_x86 *c, kmp_x86_op op, kmp_x86_order order, int d, int other, int third)
{
    kmp_x86_registers(c, ordered(c->form, op, order), d, other, third);
}

void kmp_x86_three_memory(kmp_x86 *c, kmp_x86_op op, kmp_x86_order order, int d, int other, int base, int32_t third)
{
    kmp_x86_memory(c, ordered(c->form, op, order), d, other, base, third);
}

/* Bytes by which short distances count. */
static int32_t unit_of(kmp_x86_form form)
{
    return kmp_x86_has_eights(form) ? 64 : 1;
}

static inline void put_memory(kmp_x86 *c, kmp_x86_form form, kmp_x86_op op, int d, int x, int base, int32_t y)
{
    int32_t unit = unit_of(form);
    bool is_short = y % unit == 0 && y / unit >= -SHORT && y / unit < SHORT;
    uint8_t *at = room(c);
    if (!at)
        return;
    at = put_prefix(at, form, op, d, x, 0);
    at = put(at, (is_short ? 1 : 2) << 6 | (d & 7) << 3 | base_register[base]);
    at = is_short ? put(at, (int)(y / unit) & 255) : put_32(at, y);
    finish(c, put_bits(at, op));
}

void kmp_x86_memory(kmp_x86 *c, kmp_x86_op op, int d, int x, int base, int32_t y)
{
    if (c->form == KMP_X86_ONE) {
        put_memory(c, KMP_X86_ONE, op, d, x, base, y);
        return;
    }
    put_memory(c, c->form, op, d, x, base, y);
    int second = second_register(c->form);
    if (c->form & KMP_X86_TWO)
        put_memory(c, c->form, op, d + second, x + second, base,
                   y + kmp_x86_lanes(c->form) / 2 * (int32_t)sizeof(double));
}

void kmp_x86_set_base(kmp_x86 *c, int base, int32_t distance)
{
    uint8_t *at = room(c);
    if (!at)
        return;
    if (base >= SAVED)
        at = put(at, 0x50 + base_register[base]); /* push */
    c->saved = base >= SAVED ? base : c->saved;
    at = put(at, 0x48); /* lea */
    at = put(at, 0x8d);
    at = put(at, 2 << 6 | base_register[base] << 3 | base_register[0]);
    finish(c, put_32(at, distance));
}

int kmp_x86_register_count(kmp_x86_form form)
{
    int registers = kmp_x86_has_eights(form) ? 32 : 16;
    return form & KMP_X86_TWO ? registers / 2 : registers;
}

int kmp_x86_reach(kmp_x86_form form)
{
    return 2 * SHORT * unit_of(form) / (8 * kmp_x86_lanes(form));
}

void kmp_x86_return(kmp_x86 *c)
{
    uint8_t *at = room(c);
    if (!at)
        return;
    if (c->form != KMP_X86_ONE) { /* vzeroupper */
        at = put(at, 0xc5);
        at = put(at, 0xf8);
        at = put(at, 0x77);
    }
    for (; c->saved >= SAVED; c->saved--)
        at = put(at, 0x58 + base_register[c->saved]); /* pop */
    c->saved = 0;
    finish(c, put(at, 0xc3));
}

bool kmp_x86_runs(kmp_x86_form form)
{
#if defined(__x86_64__) && defined(__GNUC__)
    bool wide = kmp_x86_has_eights(form) ? kmp_has_eight() : __builtin_cpu_supports("avx");
    return wide && __builtin_cpu_supports("fma");
#else
    (void)form;
    return false;
#endif
}

void kmp_x86_free(kmp_x86 *c)
{
    kmp_free(c->code);
    *c = (kmp_x86){.form = c->form};
}
