/* SPDX-License-Identifier: BSD-3-Clause */
#include "backend/x86/x86.h"
#include "base/memory.h"
#include <string.h>
#include <sys/mman.h>

enum { LONGEST = 16, SHORT = 128 /* least and, but one, greatest distance in a byte */ };

/* rdi, then registers that a function may overwrite and whose number needs no prefix: rsi, rdx, rcx, rax. */
static const int base_register[KMP_X86_BASES] = {7, 6, 2, 1, 0};

/* Room for one more instruction. */
static uint8_t *room(kmp_x86 *c)
{
    if (c->size + LONGEST > c->capacity) {
        size_t capacity = c->capacity ? 2 * c->capacity : 4096;
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

static void put(kmp_x86 *c, int byte)
{
    c->code[c->size++] = (uint8_t)byte;
}

static void put_32(kmp_x86 *c, int32_t x)
{
    uint32_t u = (uint32_t)x;
    for (int k = 0; k < 4; k++, u >>= 8)
        put(c, (int)(u & 255));
}

static bool is_packed(const kmp_x86 *c, kmp_x86_op op)
{
    return c->form != KMP_X86_ONE || op & KMP_X86_PAIR;
}

/* Loads and stores have no second source; a packed square root has none either. */
static bool has_source(const kmp_x86 *c, kmp_x86_op op)
{
    kmp_x86_op single = kmp_x86_single(op);
    return single != KMP_X86_LOAD && single != KMP_X86_STORE && op != KMP_X86_TWICE && op != KMP_X86_STORE_HIGH &&
           !(single == KMP_X86_SQRT && is_packed(c, op));
}

/* Prefix for registers d (ModRM.reg), x (vvvv) and y (ModRM.rm), followed by the opcode. Bits of registers are
 * inverted. */
static void put_prefix(kmp_x86 *c, kmp_x86_op op, int d, int x, int y)
{
    int r = !(d & 8), b = !(y & 8), source = has_source(c, op) ? ~x & 31 : 31, v = source & 15;
    int wide = c->form != KMP_X86_ONE, pp = is_packed(c, op) ? 1 : 3;
    if (c->form == KMP_X86_EIGHT) {
        put(c, 0x62);
        put(c, r << 7 | (y < 16) << 6 | b << 5 | (d < 16) << 4 | 1);
        put(c, 1 << 7 | v << 3 | 1 << 2 | pp);
        put(c, 2 << 5 | source >> 4 << 3);
    } else if (b) {
        put(c, 0xc5);
        put(c, r << 7 | v << 3 | wide << 2 | pp);
    } else {
        put(c, 0xc4);
        put(c, r << 7 | 1 << 6 | b << 5 | 1);
        put(c, v << 3 | wide << 2 | pp);
    }
    put(c, (int)op & 255);
}

static void put_bits(kmp_x86 *c, kmp_x86_op op)
{
    if (op >> 12)
        put(c, (int)op >> 12);
}

void kmp_x86_registers(kmp_x86 *c, kmp_x86_op op, int d, int x, int y)
{
    if (!room(c))
        return;
    if (kmp_x86_commutes(op) && x < 8 && y >= 8) { /* a byte less */
        int z = x;
        x = y;
        y = z;
    }
    put_prefix(c, op, d, x, y);
    put(c, 3 << 6 | (d & 7) << 3 | (y & 7));
    put_bits(c, op);
}

/* Bytes by which short distances count. */
static int32_t unit_of(kmp_x86_form form)
{
    return form == KMP_X86_EIGHT ? 64 : 1;
}

void kmp_x86_memory(kmp_x86 *c, kmp_x86_op op, int d, int x, int base, int32_t y)
{
    int32_t unit = unit_of(c->form);
    bool is_short = y % unit == 0 && y / unit >= -SHORT && y / unit < SHORT;
    if (!room(c))
        return;
    put_prefix(c, op, d, x, 0);
    put(c, (is_short ? 1 : 2) << 6 | (d & 7) << 3 | base_register[base]);
    if (is_short)
        put(c, (int)(y / unit) & 255);
    else
        put_32(c, y);
    put_bits(c, op);
}

void kmp_x86_set_base(kmp_x86 *c, int base, int32_t distance)
{
    if (!room(c))
        return;
    put(c, 0x48); /* lea */
    put(c, 0x8d);
    put(c, 2 << 6 | base_register[base] << 3 | base_register[0]);
    put_32(c, distance);
}

int kmp_x86_register_count(kmp_x86_form form)
{
    return form == KMP_X86_EIGHT ? 32 : 16;
}

int kmp_x86_reach(kmp_x86_form form)
{
    return 2 * SHORT * unit_of(form) / (8 * (int)form);
}

void kmp_x86_return(kmp_x86 *c)
{
    if (!room(c))
        return;
    if (c->form != KMP_X86_ONE) { /* vzeroupper */
        put(c, 0xc5);
        put(c, 0xf8);
        put(c, 0x77);
    }
    put(c, 0xc3);
}

bool kmp_x86_runs(kmp_x86_form form)
{
#if defined(__x86_64__) && defined(__GNUC__) && defined(__unix__)
    return form == KMP_X86_EIGHT ? __builtin_cpu_supports("avx512f") : __builtin_cpu_supports("avx");
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

/* -- memory to run it in ----------------------------------------------------------------------------- */

void *kmp_pages_new(const void *code, size_t size)
{
    void *pages = size > 0 ? mmap(NULL, size, PROT_READ | PROT_WRITE, MAP_PRIVATE | MAP_ANONYMOUS, -1, 0) : MAP_FAILED;
    if (pages == MAP_FAILED)
        return NULL;
    memcpy(pages, code, size);
    if (mprotect(pages, size, PROT_READ | PROT_EXEC) == 0)
        return pages;
    (void)munmap(pages, size);
    return NULL;
}

void kmp_pages_free(void *pages, size_t size)
{
    if (pages)
        (void)munmap(pages, size);
}
