/* SPDX-License-Identifier: BSD-3-Clause */
/* Implicit blocks of a routine's program, each as routines of its own: for languages that solve them. */
#pragma once

#include "generate/blocks/place_values.h"
#include "generate/source.h"

struct kmp_code_block {
    const kmp_program_block *block;
    /* Of arguments p and unknowns q; merit: without candidates no program. Of averages `guess` is the exponent at the
     * place q[0] and the one that is needed, `equations` the averaged values there, with further q by place. */
    kmp_code_routine guess, merit, equations;
    kmp_place_values guess_rows, equations_rows; /* of averages */
};

/** Makes the blocks of a routine, which owns them. */
kempe_status kmp_code_blocks_make(kmp_code_source *source, kmp_code_routine *routine);
void kmp_code_blocks_free(kmp_code_routine *routine);

/** The source of the routines of blocks: their parameters are arguments of a block. */
bool kmp_code_block_source(const kmp_code_source *of, kmp_arena *arena, kmp_code_source *source);

/** Item k of the list of an implicit instruction as an operand. */
uint32_t kmp_code_block_item(const kmp_program *program, uint32_t list, int k);
