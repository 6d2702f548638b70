/* SPDX-License-Identifier: BSD-3-Clause */
/* This is what machine code has in common on all processors: operations on doubles, forms of registers, code that is
 * being written; and the functions and properties in which processors differ. Allocation of registers (registers.h) and
 * operations in pairs (packs.h) are written for all of them. */
#pragma once

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

enum { KMP_CODE_REGISTERS = 32, KMP_CODE_BASES = 7, KMP_CODE_HELD = 8 }; /* bounds */

/** A form is the number of doubles of a slot, with one bit where each value has two registers, and another where code
 * works on four lanes of a slot: it runs once for each four. Two registers have operations whose chains overlap. */
typedef enum kmp_code_form {
    KMP_CODE_ONE = 1,
    KMP_CODE_FOUR = 4,
    KMP_CODE_EIGHT = 8,
    KMP_CODE_TWO = 32,
    KMP_CODE_TWO_TWOS = KMP_CODE_TWO + 4,
    KMP_CODE_TWO_FOURS = KMP_CODE_TWO + 8,
    KMP_CODE_TWO_EIGHTS = KMP_CODE_TWO + 16,
    KMP_CODE_PARTS = 64,
    KMP_CODE_EIGHT_IN_PARTS = KMP_CODE_PARTS + KMP_CODE_TWO + 8,
    KMP_CODE_SIXTEEN_IN_PARTS = KMP_CODE_PARTS + KMP_CODE_TWO + 16
} kmp_code_form;

/** The number of doubles of a slot; how many of them a call of the code works on, from its first argument on. */
static inline int kmp_code_lanes(kmp_code_form form)
{
    return (int)form & (KMP_CODE_TWO - 1);
}
static inline int kmp_code_at_once(kmp_code_form form)
{
    return form & KMP_CODE_PARTS ? 4 : kmp_code_lanes(form);
}

/** An operation is a number, with a bit for operations on pairs of doubles in the form of one double, and a bit for
 * operations of three sources. */
typedef enum kmp_operation {
    KMP_DO_LOAD,
    KMP_DO_STORE,
    KMP_DO_SQRT,
    KMP_DO_ADD,
    KMP_DO_MUL,
    KMP_DO_SUB,
    KMP_DO_DIV,
    KMP_DO_MAX,             /* x > y ? x : y, which is y if an operand is NaN */
    KMP_DO_TWICE,           /* y in both lanes */
    KMP_DO_HIGH,            /* lane 1 of y */
    KMP_DO_PAIR = 0x100,    /* of the operations above down to MAX: on both lanes */
    KMP_DO_SUB_ADD = 0x10a, /* x - y in lane 0, x + y in lane 1 */
    KMP_DO_XOR,             /* of the bits of x and y */
    KMP_DO_LOW_LOW,         /* a lane of x, then one of y */
    KMP_DO_LOW_HIGH,
    KMP_DO_HIGH_LOW,
    KMP_DO_HIGH_HIGH,
    KMP_DO_LOAD_HIGH,  /* lane 0 of x, then y in memory */
    KMP_DO_STORE_HIGH, /* lane 1 */
    KMP_DO_THREE = 0x200,
    KMP_DO_PRODUCT_ADD = 0x212,     /* x * y + z, with one rounding */
    KMP_DO_PRODUCT_SUB,             /* x * y - z */
    KMP_DO_SUB_PRODUCT,             /* z - x * y */
    KMP_DO_PRODUCT_SUB_ADD = 0x315, /* x * y - z in lane 0, x * y + z in lane 1 */
    KMP_DO_PRODUCT_ADD_SUB,
    KMP_DO_COUNT = 0x17
} kmp_operation;

/** Its row in an encoder's table; without the bit for pairs; operations that read only y; that may exchange x and y. */
static inline int kmp_operation_row(kmp_operation op)
{
    return (int)op & 0xff;
}
static inline kmp_operation kmp_operation_single(kmp_operation op)
{
    return (kmp_operation)((unsigned)op & ~(unsigned)KMP_DO_PAIR);
}
static inline bool kmp_operation_is_unary(kmp_operation op)
{
    kmp_operation single = kmp_operation_single(op);
    return single == KMP_DO_LOAD || single == KMP_DO_SQRT || op == KMP_DO_TWICE || op == KMP_DO_HIGH;
}
static inline bool kmp_operation_commutes(kmp_operation op)
{
    return kmp_operation_single(op) == KMP_DO_ADD || kmp_operation_single(op) == KMP_DO_MUL;
}
static inline bool kmp_operation_has_three(kmp_operation op)
{
    return op & KMP_DO_THREE;
}

/** A place in memory: a base and the distance from it in bytes. Base 0 is the first argument of a function; further
 * bases are its next arguments, or set by it. */
typedef struct kmp_code_address {
    int base;
    int32_t distance;
} kmp_code_address;

/** The sources of an operation of three: registers of x, y and z; of one it may be -1: it is in memory, `at`. The
 * result goes to register d; where an encoder reads memory, that is the register of source `into`. */
typedef struct kmp_three_sources {
    int d, into, from[3];
    kmp_code_address at;
} kmp_three_sources;

typedef struct kmp_encoder kmp_encoder;

/** Code that is being written; `failed`: out of memory, sticky. */
typedef struct kmp_written_code {
    const kmp_encoder *encoder;
    kmp_code_form form;
    uint8_t *code;
    size_t size, capacity;
    size_t expected; /* about its size, in bytes; 0: unknown */
    bool failed;
    /* Of the function that is being written: */
    size_t begin;
    int saved;                            /* the last register that its end restores; 0: none */
    kmp_code_address held[KMP_CODE_HELD]; /* places whose addresses registers have, base -1: none */
    int next_held;                        /* of these */
} kmp_written_code;

/** A processor: its properties, and the functions that append its instructions. */
struct kmp_encoder {
    const char *name;
    const kmp_code_form *forms; /* that it has, the best of equally many lanes first; the last one is 0 */
    bool mixes_pairs;           /* a pair may have a sum in one lane, a difference in the other */
    bool reads_memory;          /* one source may be in memory; the result of an operation of three replaces a source */
    int bases;                  /* that code can set, with base 0; 1: distances need none */
    /** True if this machine runs the form. */
    bool (*runs)(kmp_code_form form);
    int (*register_count)(kmp_code_form form);
    /** Number of doubles that short distances from one base reach; NULL without bases. */
    int (*reach)(kmp_code_form form);
    /** Sets a base other than 0 to a distance in bytes from base 0, in ascending order before all else of a function;
     * NULL without bases. */
    void (*set_base)(kmp_written_code *c, int base, int32_t distance);
    /** d = x op y; unary: d = op y, x is the register of d. */
    void (*registers)(kmp_written_code *c, kmp_operation op, int d, int x, int y);
    /** d = x op y with y in memory. LOAD: d = y, x is 0; STORE: y = d, x is 0. Encoders that do not read memory have
     * loads and stores only. */
    void (*memory)(kmp_written_code *c, kmp_operation op, int d, int x, kmp_code_address y);
    void (*three)(kmp_written_code *c, kmp_operation op, const kmp_three_sources *s);
    /** The end of a function. */
    void (*end)(kmp_written_code *c);
};

/** Begins a function. */
void kmp_written_begin(kmp_written_code *c);

/** Room for more bytes, at least `bytes` behind c->size; NULL: no memory. */
uint8_t *kmp_written_room(kmp_written_code *c, size_t bytes);

void kmp_written_free(kmp_written_code *c);
