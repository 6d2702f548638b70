/* SPDX-License-Identifier: BSD-3-Clause */
/* Implicit blocks of a routine's program, each as separate routines: for languages that solve them. */
#pragma once

#include "exchange/code/source.h"

/** Programs of a block, each a routine of arguments p and unknowns q. Of averages the guess is the exponent at the
 * place q[0] and the one that is needed, the equations are the averaged values there. Merit and scan belong to a
 * block among candidates: at any q, and at one of the candidates. Parts at places have further q by place. */
typedef enum kmp_block_part {
    KMP_PART_GUESS,
    KMP_PART_MERIT,
    KMP_PART_SCAN,
    KMP_PART_EQUATIONS,
    KMP_BLOCK_PARTS
} kmp_block_part;

/** Values of a block that depend only on unknown 0, at its candidates or places, numbers that are known when code is
 * generated: rows of the places, `width` numbers each: the place q[0], then the values q[unknowns] and so on. */
typedef struct kmp_place_values {
    int width;
    double *rows;
} kmp_place_values;

struct kmp_code_block {
    const kmp_program_block *block;
    kmp_code_routine part[KMP_BLOCK_PARTS]; /* without a program: the block lacks it */
    kmp_place_values rows[KMP_BLOCK_PARTS]; /* width 0: none */
};

extern const char *const kmp_block_part_names[KMP_BLOCK_PARTS];

/** Makes the blocks of a routine, which owns them. */
kempe_status kmp_code_blocks_make(kmp_code_source *source, kmp_code_routine *routine);
void kmp_code_blocks_free(kmp_code_routine *routine);

/** The programs of a routine from number *i on, which moves: its own, then the functions of the parts of its blocks.
 * NULL: there are no more. */
const kmp_program *kmp_code_next_program(const kmp_code_routine *routine, int *i);

/** The source of the routines of blocks: their parameters are arguments of a block. */
bool kmp_code_block_source(const kmp_code_source *of, kmp_arena *arena, kmp_code_source *source);

/** Item k of the list of an implicit instruction as an operand. */
uint32_t kmp_code_block_item(const kmp_program *program, uint32_t list, int k);
