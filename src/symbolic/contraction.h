/* SPDX-License-Identifier: BSD-3-Clause */
/* Products that are computed together with the sum that reads them. In a program that contracts they are rounded once
 * (fusedMultiplyAdd of IEEE 754). The choice depends only on the program, so that all that evaluate it have the same
 * bits. */
#pragma once

#include "symbolic/program.h"

/** The evaluation of an instruction: separately; a sum together with the product that is its first or second operand; a
 * product as part of the sum that reads it, not by itself. */
typedef enum kmp_contraction { KMP_ALONE, KMP_WITH_FIRST, KMP_WITH_SECOND, KMP_CONTRACTED } kmp_contraction;

/** A kmp_contraction for each instruction, in the arena. Only instructions that the outputs from `first` to `end`
 * need are computed. NULL: no memory. */
uint8_t *kmp_program_contraction(const kmp_program *program, int first, int end, kmp_arena *arena);

/** Lets the program contract, except for what these outputs need. False: no memory. */
bool kmp_program_contract(kmp_program *program, int first, int end);

/** Operands of a sum that takes a product: the result is x * y + z, with the signs of all three. */
typedef struct kmp_multiply_add {
    uint32_t product; /* its instruction */
    uint32_t x, y, z;
} kmp_multiply_add;

kmp_multiply_add kmp_multiply_add_of(const kmp_program *program, int sum, kmp_contraction with);
