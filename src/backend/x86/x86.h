/* SPDX-License-Identifier: BSD-3-Clause */
/* Machine code of x86-64 processors with AVX and FMA: arithmetic on doubles in registers and in memory. Addresses are
 * relative to base 0 (rdi, the first argument of a function), or to further bases, which serve to keep distances short:
 * these fit in a byte within 128 bytes, of eight doubles within 128 of them. Forms: one double, four (ymm), eight (zmm,
 * AVX-512), and two registers of four or of eight, whose chains of operations overlap. The first two have the registers
 * 0 to 15, the third 0 to 31. Of two registers of four, register k is k and k + 8; of eight, k and k + 16. Encodings:
 * Intel 64 and IA-32 Architectures Software Developer's Manual, volume 2, sections 2.3 (VEX) and 2.7 (EVEX). */
#pragma once

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

enum { KMP_X86_REGISTERS = 32, KMP_X86_BASES = 7 }; /* bounds */

/** A form is its number of doubles, and for two registers another bit. */
typedef enum kmp_x86_form {
    KMP_X86_ONE = 1,
    KMP_X86_FOUR = 4,
    KMP_X86_EIGHT = 8,
    KMP_X86_TWO = 32,
    KMP_X86_TWO_FOURS = KMP_X86_TWO + 8,
    KMP_X86_TWO_EIGHTS = KMP_X86_TWO + 16
} kmp_x86_form;

static inline int kmp_x86_lanes(kmp_x86_form form)
{
    return (int)form & (KMP_X86_TWO - 1);
}

/** True for registers of eight doubles. */
static inline bool kmp_x86_has_eights(kmp_x86_form form)
{
    return form == KMP_X86_EIGHT || form == KMP_X86_TWO_EIGHTS;
}

/** An operation is its opcode; then a bit for operations on pairs of doubles, in the form of one double; a bit for
 * operations of three sources, whose opcode is without the bits for the order of the sources; then bits that follow as
 * a byte. */
typedef enum kmp_x86_op {
    KMP_X86_LOAD = 0x10,
    KMP_X86_STORE = 0x11,
    KMP_X86_SQRT = 0x51,
    KMP_X86_ADD = 0x58,
    KMP_X86_MUL = 0x59,
    KMP_X86_SUB = 0x5c,
    KMP_X86_DIV = 0x5e,
    KMP_X86_MAX = 0x5f,      /* x > y ? x : y, which is y if an operand is NaN */
    KMP_X86_PAIR = 0x100,    /* of the operations above: on both lanes */
    KMP_X86_SUB_ADD = 0x1d0, /* x - y in lane 0, x + y in lane 1 */
    KMP_X86_THREE = 0x200,
    KMP_X86_PRODUCT_ADD = 0x208,     /* x * y + z, with one rounding */
    KMP_X86_PRODUCT_SUB = 0x20a,     /* x * y - z */
    KMP_X86_SUB_PRODUCT = 0x20c,     /* z - x * y */
    KMP_X86_PRODUCT_SUB_ADD = 0x306, /* x * y - z in lane 0, x * y + z in lane 1 */
    KMP_X86_PRODUCT_ADD_SUB = 0x307,
    KMP_X86_XOR = 0x157,     /* of the bits of x and y */
    KMP_X86_TWICE = 0x12,    /* y in both lanes */
    KMP_X86_LOW_LOW = 0x114, /* a lane of x, then one of y */
    KMP_X86_LOW_HIGH = 0x21c6,
    KMP_X86_HIGH_LOW = 0x11c6,
    KMP_X86_HIGH_HIGH = 0x115,
    KMP_X86_LOAD_HIGH = 0x116,  /* lane 0 of x, then y in memory */
    KMP_X86_STORE_HIGH = 0x117, /* lane 1 */
    KMP_X86_HIGH = 0x1000       /* lane 1 of y; no instruction: HIGH_HIGH, or LOAD */
} kmp_x86_op;

/** Without the bit for pairs; operations that read only y; that may exchange x and y. */
static inline kmp_x86_op kmp_x86_single(kmp_x86_op op)
{
    return (kmp_x86_op)((unsigned)op & ~(unsigned)KMP_X86_PAIR);
}
static inline bool kmp_x86_is_unary(kmp_x86_op op)
{
    kmp_x86_op single = kmp_x86_single(op);
    return single == KMP_X86_LOAD || single == KMP_X86_SQRT || op == KMP_X86_TWICE || op == KMP_X86_HIGH;
}
static inline bool kmp_x86_commutes(kmp_x86_op op)
{
    return kmp_x86_single(op) == KMP_X86_ADD || kmp_x86_single(op) == KMP_X86_MUL;
}
static inline bool kmp_x86_has_three(kmp_x86_op op)
{
    return op & KMP_X86_THREE;
}

/** The source whose register receives the result of an operation of three, with the source that may be in memory: x and
 * y, x and z, z and y. Factors may exchange their names. */
typedef enum kmp_x86_order { KMP_X86_INTO_X_WITH_Y, KMP_X86_INTO_X_WITH_Z, KMP_X86_INTO_Z_WITH_Y } kmp_x86_order;

/** Code that is being written; `failed`: out of memory, sticky. */
typedef struct kmp_x86 {
    uint8_t *code;
    size_t size, capacity;
    size_t expected; /* about its size, in bytes; 0: unknown */
    kmp_x86_form form;
    int saved; /* the last base that the end of the function restores; 0: none */
    bool failed;
} kmp_x86;

/** d = x op y; SQRT: d = sqrt y, x is the register of d. */
void kmp_x86_registers(kmp_x86 *c, kmp_x86_op op, int d, int x, int y);
/** d = x op y with y in memory, at a distance in bytes from a base. LOAD: d = y, x is 0; STORE: y = d, x is 0. */
void kmp_x86_memory(kmp_x86 *c, kmp_x86_op op, int d, int x, int base, int32_t y);
/** Operations of three sources: d is the source that the order names and receives the result; `other` is the source
 * that the order does not name; the third one, y or z, is a register or in memory. */
void kmp_x86_three(kmp_x86 *c, kmp_x86_op op, kmp_x86_order order, int d, int other, int third);
void kmp_x86_three_memory(kmp_x86 *c, kmp_x86_op op, kmp_x86_order order, int d, int other, int base, int32_t third);
/** Sets a base other than 0 to a distance in bytes from base 0, in ascending order before all else of a function. */
void kmp_x86_set_base(kmp_x86 *c, int base, int32_t distance);
/** The end of a function. */
void kmp_x86_return(kmp_x86 *c);

/** Number of registers; of doubles that short distances from one base reach. */
int kmp_x86_register_count(kmp_x86_form form);
int kmp_x86_reach(kmp_x86_form form);

/** True if this machine runs the form. */
bool kmp_x86_runs(kmp_x86_form form);

void kmp_x86_free(kmp_x86 *c);
