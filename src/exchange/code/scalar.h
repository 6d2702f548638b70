/* SPDX-License-Identifier: BSD-3-Clause */
/* One stage of a routine as scalar assignments, in any language: the choice of variables and of chunks, and the text of
 * expressions. Every operation is written as it is in the program, so that a language with IEEE doubles computes the
 * same bits. */
#pragma once

#include "exchange/code/language.h"

/** The target of a value: entry (row, col) of an array, or of k when array is -1. */
typedef struct kmp_sink {
    uint32_t operand;
    int array, row, col; /* col -1: a vector */
    int next;            /* the next sink of this instruction, -1: none */
} kmp_sink;

/** An assignment: of instruction `value`, and with it of `partner`, its cosine or sine (-1: none). */
typedef struct kmp_statement {
    int value, partner, chunk;
} kmp_statement;

typedef struct kmp_scalar {
    const kmp_code_source *source;
    const kmp_code_routine *routine;
    const kmp_program *p;
    const kmp_language *language;
    kmp_arena arena; /* of all arrays */
    int stage, leaves;
    /* by instruction */
    int *uses, *length, *variable; /* number of its variable from 1 on, 0: part of its user's expression */
    int *first_chunk, *last_chunk; /* in which its variable is set and read */
    int *slot;                     /* + 1, of a variable that several chunks see */
    int *sink;                     /* the first one, -1: none */
    char **name;                   /* of the variable; NULL: v and its number */
    kmp_statement *statements;
    int count, variables, chunks, slots;
    kmp_sink *sinks;
    int sink_count;
    unsigned used; /* arguments met while writing, as bits; k has the bit of KMP_IN_PARAMETER */
    bool slots_used;
    const kmp_label *label; /* of the value written last */
    int solved;             /* instruction whose block was solved last in this chunk; -1: none was */
} kmp_scalar;

/** false: no memory. */
bool kmp_scalar_init(kmp_scalar *s, const kmp_code_source *source, const kmp_code_routine *routine, int stage,
                     const kmp_language *language);
void kmp_scalar_free(kmp_scalar *s);

/** True if an array has entries that are zero, which nothing is assigned to. */
bool kmp_scalar_has_zeros(const kmp_scalar *s, int array);

/** The statements of a chunk, from statement *at on, which moves; the arrays that it writes to, bits 1 << array. */
unsigned kmp_scalar_chunk(kmp_scalar *s, kmp_text *text, int chunk, int *at);
