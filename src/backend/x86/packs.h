/* SPDX-License-Identifier: BSD-3-Clause */
/* Two operations of one kind on different values as one operation on the two lanes of a register, where sub-expressions
 * of one shape occur again: the legs of a platform, the wheels of a vehicle. Each lane rounds as the operation alone,
 * so that the bits are unchanged (superword parallelism, Larsen and Amarasinghe 2000). */
#pragma once

#include "backend/x86/registers.h"

#define KMP_NO_OPERATION UINT32_MAX

/* The operations of a piece of code, and which of them go together. */
typedef struct kmp_pack_choice {
    uint32_t count;
    const kmp_straight *operations;
    const uint32_t *writer; /* by slot: the operation that writes it, + 1; 0: none */
    uint32_t *mate;         /* by operation: the other one; KMP_NO_OPERATION: it stays alone */
    uint8_t *lane;          /* its lane: 0 or 1 */
    /* of the search: */
    uint32_t *shape;   /* by operation: number of its shape, from 1 on; values from elsewhere have shape 0 */
    uint32_t *next;    /* by operation: the next one of its shape that may be without mate */
    uint32_t *trial;   /* by operation: its mate on trial */
    uint32_t *stamp;   /* the trial that this belongs to */
    uint8_t *side;     /* its lane there */
    uint32_t now;      /* number of the trial */
    uint32_t *paired;  /* operations of the trial, in pairs */
    uint32_t *pending; /* pairs to be visited */
} kmp_pack_choice;

/** Chooses the pairs; mate and lane are the results, in the arena. False: no memory. */
bool kmp_pack_choose(kmp_pack_choice *c, kmp_arena *arena, uint32_t count, const kmp_straight *operations,
                     const uint32_t *writer);

/** True if the operands of the two are paired crosswise: those of `*turned`, one of the two, exchanged. */
bool kmp_pack_is_crossed(const kmp_pack_choice *c, uint32_t a, uint32_t b, uint32_t *turned);

/** True if operations of one kind in the two lanes need the negative of an operand of one of them. */
bool kmp_pack_negates(kmp_x86_op low, kmp_x86_op high);

/* A pair of numbers that are known when the code is written. */
typedef struct kmp_pack_constant {
    uint32_t slot;
    double value[2];
} kmp_pack_constant;

/* State over the pieces of a program. A value that is a pack is named by the first of its two slots. */
typedef struct kmp_packs {
    kmp_arena *arena;
    const double *values;        /* of the constants, by slot */
    uint32_t first, end;         /* slots of the constants */
    uint32_t slots;              /* packs have slots from here on */
    uint32_t next;               /* the first unused slot */
    uint32_t *writer;            /* by slot */
    kmp_pack_constant *constant; /* to be set before the code runs */
    int constants;
} kmp_packs;

/** Begins after the slots of a frame. False: no memory. */
bool kmp_packs_init(kmp_packs *p, kmp_arena *arena, uint32_t slots, const double *values, uint32_t first, uint32_t end);

/** Replaces the operations of a piece by fewer, in the arena, where that pays. False: no memory. */
bool kmp_packs_make(kmp_packs *p, uint32_t *count, const kmp_straight **operations);
