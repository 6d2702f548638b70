/* SPDX-License-Identifier: BSD-3-Clause */
/* Two operations of one kind on different values as one operation on the two lanes of a register, where sub-expressions
 * of one shape occur again: the legs of a platform, the wheels of a vehicle. Each lane rounds as a single operation
 * does, so that the bits are unchanged (superword parallelism, Larsen and Amarasinghe 2000). */
#pragma once

#include "backend/encoder/registers.h"

/* A pair of numbers that are known when the code is written. */
typedef struct kmp_pack_constant {
    uint32_t slot;
    double value[2];
} kmp_pack_constant;

/* State over the pieces of a program. A value that is a pack is named by the first of its two slots. */
typedef struct kmp_packs {
    kmp_arena *arena;
    const kmp_encoder *encoder;
    const double *values;        /* of the constants, by slot */
    uint32_t first, end;         /* slots of the constants */
    uint32_t slots;              /* packs have slots from here on */
    uint32_t next;               /* the first unused slot */
    uint32_t *writer;            /* by slot */
    kmp_pack_constant *constant; /* to be set before the code runs */
    int constants;
} kmp_packs;

/** Begins after the slots of a frame. False: no memory. */
bool kmp_packs_init(kmp_packs *p, kmp_arena *arena, const kmp_encoder *encoder, uint32_t slots, const double *values,
                    uint32_t first, uint32_t end);

/** Replaces the operations of a piece by fewer, in the arena, where that pays. False: no memory. */
bool kmp_packs_make(kmp_packs *p, uint32_t *count, const kmp_straight **operations);
