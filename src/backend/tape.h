/* SPDX-License-Identifier: BSD-3-Clause */
/* The branch-free tape between its two halves: made from a program by tape_prepare.c, run by tape.c, which says what it
 * is. */
#ifndef KMP_BACKEND_TAPE_H
#define KMP_BACKEND_TAPE_H

#include "backend/machine.h"
#include "symbolic/implicit.h"

typedef struct record16 {
    uint16_t d, a, b, c;
} record16;

typedef struct record32 {
    uint32_t d, a, b, c;
} record32;

/* A division or a function. */
typedef struct special {
    uint8_t op;
    bool minus[3]; /* of the operands */
    uint32_t d, operand[3], instruction;
} special;

typedef struct segment {
    uint32_t record, angle, special; /* the first of each; the next segment's are the end */
} segment;

/* An output that no instruction of its stage computes straight into its place. */
typedef struct copy {
    uint32_t from, to;
    double factor; /* 1 or -1 */
} copy;

/* An item of the list that an implicit block takes. */
typedef struct argument {
    uint32_t slot;
    double factor; /* 1 or -1 */
} argument;

/* An input: where its value goes and where in the vector given it stands. */
typedef struct feed {
    uint32_t slot, index;
} feed;

typedef struct tape {
    const kmp_program *program;
    double *v; /* slots: 1, -1, -0, waste, constants, inputs, instructions, outputs, negatives of constants as asked */
    uint32_t slots;
    record16 *narrow; /* one of the two */
    record32 *wide;
    uint32_t records;
    special *specials;
    uint32_t special_count;
    uint32_t *angle, *sine, *cosine; /* slots; sine or cosine may be the waste slot */
    uint32_t angles;
    double *lane; /* 3 x angles */
    segment *segments;
    uint32_t segment_count;
    uint32_t *stage; /* stages + 1: first segment */
    copy *copies;
    uint32_t *copy_start; /* stages + 1: first copy */
    double *out;          /* the outputs' slots */
    feed *feeds;
    int feed_start[KMP_IN_COUNT + 1]; /* first feed of each kind */
    kmp_solving **solving;            /* of each block */
    argument *arguments;              /* of implicit instructions, one after another */
    uint32_t argument_count;
} tape;

enum { SLOT_ONE, SLOT_MINUS_ONE, SLOT_MINUS_ZERO, SLOT_WASTE, FIRST_SLOT };

/** The back end's `prepare` and `release`. */
void *kmp_tape_prepare(const kmp_program *program);
void kmp_tape_release(void *code);

#endif
