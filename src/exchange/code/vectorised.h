/* SPDX-License-Identifier: BSD-3-Clause */
/* A routine for array languages: values by step index, which is one more than the largest index of a value's operands
 * (Fisette and Samin 1996, section 3.2). In each step all operations of one kind are one statement.
 *
 * Sums and products are one kind, c + s a b with s = 1 or -1: x + y is x + 1 y 1, and a product that only one sum reads
 * is part of it. All values are in one vector: the numbers, beginning with 0 and 1, then the arguments, then results.
 */
#pragma once

#include "exchange/code/language.h"

/** Results first, first + 1, ... of an operation (MUL for c + s a b) on items start, start + 1, ... */
typedef struct kmp_group {
    kmp_op op;
    uint32_t table, derivative;
    int level, first, start, count;
    bool minus[3];         /* some operand of the column has a sign; of MUL: [0], some s is -1 */
    bool adds, multiplies; /* of MUL: some c is not 0, some b is not 1 */
} kmp_group;

typedef struct kmp_nesting_levels {
    kmp_arena arena; /* of all arrays */
    const kmp_code_routine *routine;
    double *numbers;
    int number_count;
    int at[KMP_ARGUMENTS], width[KMP_ARGUMENTS]; /* position and length of an argument in the vector; PARAMETER: k;
                                                  width 0: no such argument */
    int size;                                    /* of the vector */
    int steps;
    int *operand[3]; /* by item: places in the vector */
    bool *minus[3];
    kmp_group *groups; /* step by step */
    int group_count;
    int *output; /* by output of stage 1: its position in the vector */
} kmp_nesting_levels;

/** false: no memory. */
bool kmp_levels_init(kmp_nesting_levels *levels, const kmp_code_source *source, const kmp_code_routine *routine);
void kmp_levels_free(kmp_nesting_levels *levels);

/* Words of the templates. */
void kmp_vectorised_lists(const kmp_code_writer *writer);
void kmp_vectorised_groups(const kmp_code_writer *writer);
void kmp_vectorised_operands(const kmp_code_writer *writer);
void kmp_vectorised_results(const kmp_code_writer *writer);
void kmp_vectorised_list(const kmp_code_writer *writer);
