/* SPDX-License-Identifier: BSD-3-Clause */
/* Straight-line code over slots as machine code: allocation of values to registers. When a register is needed, the
 * value whose next use is farthest away leaves its register (Belady 1966). It is stored at a place that is used again
 * after its last use, so that code and data stay short. */
#pragma once

#include "backend/encoder/encoder.h"
#include "base/arena.h"

/** slot d = slot x op slot y, for operations of three sources also with slot z. SQRT: of y. LOAD: a copy of y. No slot
 * is written twice. A pair (kmp_packs) is named by
 * its first slot; one by one, it is read there as its lane 0. */
typedef struct kmp_straight {
    uint32_t d, x, y, z;
    uint16_t op;        /* a kmp_operation */
    bool kept;          /* the code that follows reads d, too */
    uint32_t low, high; /* of a pair: slots of the lanes that the code that follows reads; 0: it does not */
} kmp_straight;

enum { KMP_PLACES = 1024 }; /* bound, a multiple of 64 */

/** Data of allocation by slot: shared by all pieces of code. */
typedef struct kmp_registers {
    uint32_t slots, packs; /* number; from which on they belong to pairs */
    uint32_t places, used; /* places after the slots; the ones that some code uses: the first ones */
    uint64_t taken[KMP_PLACES / 64];
    const kmp_code_address *address;    /* of slots; NULL: slot k is at byte 8 k width of base 0. A caller's bases are
                                         * further arguments of the code, which then sets none: `shared` */
    uint32_t *place;                    /* of a value that has left its register: + 1; 0: its slot */
    uint32_t *next;                     /* next use, as a position */
    int16_t *in;                        /* register, -1: none */
    uint8_t *missing;                   /* the register's value is not yet stored in the slot */
    uint32_t *after;                    /* by operation: next uses of x, y and z after it */
    uint32_t holds[KMP_CODE_REGISTERS]; /* slot + 1 in each register, 0: none */
    uint32_t until[KMP_CODE_REGISTERS]; /* next use of the value in each register */
    uint32_t is_free;                   /* a bit for each register */
} kmp_registers;

/** For pieces of up to `longest` operations, with arrays in the arena. `shared`: pieces may run at once, and store each
 * value in its slot. `packs`: the first slot of pairs, of `slots`. false: no memory. */
bool kmp_registers_init(kmp_registers *r, kmp_arena *arena, uint32_t packs, uint32_t slots, uint32_t longest,
                        bool shared);

/** Appends the code of the operations, in their order, and a return. Slot k is at byte 8 k width of the form; places
 * follow the slots. */
void kmp_registers_write(kmp_registers *r, kmp_written_code *c, uint32_t count, const kmp_straight *operations);
