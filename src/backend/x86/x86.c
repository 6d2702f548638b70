/* SPDX-License-Identifier: BSD-3-Clause */
#include "backend/x86/x86.h"
#include "base/memory.h"
#include <string.h>
#include <sys/mman.h>

enum { LONGEST = 16, BASE = 7 /* rdi */ };

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

/* Loads and stores have no second source; a packed square root has none either. */
static bool has_source(kmp_x86_form form, kmp_x86_op op)
{
    return op != KMP_X86_LOAD && op != KMP_X86_STORE && !(op == KMP_X86_SQRT && form != KMP_X86_ONE);
}

static uint8_t *put(uint8_t *at, int byte)
{
    *at = (uint8_t)byte;
    return at + 1;
}

/* Prefix for registers d (ModRM.reg), x (vvvv) and y (ModRM.rm), followed by the opcode; returns the place after it.
 * Bits of registers are inverted. */
static uint8_t *put_prefix(uint8_t *at, kmp_x86_form form, kmp_x86_op op, int d, int x, int y)
{
    int r = d < 8, b = y < 8, v = has_source(form, op) ? ~x & 15 : 15;
    int packed = form != KMP_X86_ONE, pp = packed ? 1 : 3;
    if (form == KMP_X86_EIGHT) {
        at = put(at, 0x62);
        at = put(at, r << 7 | 1 << 6 | b << 5 | 1 << 4 | 1);
        at = put(at, 1 << 7 | v << 3 | 1 << 2 | pp);
        at = put(at, 2 << 5 | 1 << 3);
    } else if (b) {
        at = put(at, 0xc5);
        at = put(at, r << 7 | v << 3 | packed << 2 | pp);
    } else {
        at = put(at, 0xc4);
        at = put(at, r << 7 | 1 << 6 | b << 5 | 1);
        at = put(at, v << 3 | packed << 2 | pp);
    }
    return put(at, (int)op);
}

static void finish(kmp_x86 *c, const uint8_t *end)
{
    c->size = (size_t)(end - c->code);
}

void kmp_x86_registers(kmp_x86 *c, kmp_x86_op op, int d, int x, int y)
{
    uint8_t *at = room(c);
    if (!at)
        return;
    if ((op == KMP_X86_ADD || op == KMP_X86_MUL) && x < 8 && y >= 8) { /* a byte less */
        int z = x;
        x = y;
        y = z;
    }
    at = put_prefix(at, c->form, op, d, x, y);
    finish(c, put(at, 3 << 6 | (d & 7) << 3 | (y & 7)));
}

void kmp_x86_memory(kmp_x86 *c, kmp_x86_op op, int d, int x, int32_t y)
{
    int32_t unit = c->form == KMP_X86_EIGHT ? 64 : 1; /* short distances count in these */
    bool is_short = y % unit == 0 && y / unit >= -128 && y / unit <= 127;
    uint8_t *at = room(c);
    if (!at)
        return;
    at = put_prefix(at, c->form, op, d, x, BASE);
    at = put(at, (is_short ? 1 : 2) << 6 | (d & 7) << 3 | BASE);
    uint32_t rest = (uint32_t)(is_short ? y / unit : y);
    for (int k = 0; k < (is_short ? 1 : 4); k++, rest >>= 8)
        at = put(at, (int)(rest & 255));
    finish(c, at);
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
    finish(c, put(at, 0xc3));
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
