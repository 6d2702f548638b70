/* SPDX-License-Identifier: BSD-3-Clause */
/* Words of program text: definitions common to writer and reader, and the reader's smallest rules. A rule that fails
 * has reported the error and returns false. */
#ifndef KMP_SYMBOLIC_PROGRAM_PROGRAM_WORDS_H
#define KMP_SYMBOLIC_PROGRAM_PROGRAM_WORDS_H

#include "base/context.h"
#include "symbolic/program/program.h"

extern const char *const kmp_input_words[KMP_IN_COUNT];

/* Until all counts are final, operands have their class in the highest bits. */
enum { KMP_OF_CONSTANT, KMP_OF_INPUT, KMP_OF_INSTRUCTION, KMP_CLASS_SHIFT = 29 };

typedef struct kmp_program_reader {
    kempe_context *context;
    const char *file, *at, *line_start;
    int line;
    kempe_status status;
    kmp_program *p;
    kmp_arena arena;                         /* of all arrays but those of the program */
    int code, outputs;                       /* so far */
    uint32_t *constant, *input;              /* hash tables: number + 1 */
    size_t constant_size;                    /* capacity of each array */
    double *x, *y;                           /* points of a table */
    const struct kmp_program_reader *around; /* whose implicit block this is */
} kmp_program_reader;

/** Reports an error; the first one is kept. */
bool kmp_words_complain(kmp_program_reader *r, const char *format, ...) __attribute__((format(printf, 2, 3)));
bool kmp_words_no_memory(kmp_program_reader *r);

/** kmp_words_skip: skips blanks. The others: go to the first line that is not empty, here or after the end of this
 * line. */
void kmp_words_skip(kmp_program_reader *r);
void kmp_words_skip_lines(kmp_program_reader *r);
bool kmp_words_next_line(kmp_program_reader *r);

/** True if the text continues with these characters (_word: and no letter follows), which are then skipped. */
bool kmp_words_take(kmp_program_reader *r, const char *characters);
bool kmp_words_take_word(kmp_program_reader *r, const char *word);
bool kmp_words_want(kmp_program_reader *r, const char *characters);

/** The number of letters at s. */
size_t kmp_words_letters(const char *s);

bool kmp_words_index(kmp_program_reader *r, uint32_t *index);
bool kmp_words_number(kmp_program_reader *r, double *value);

/** A number, an input or an earlier value, with a sign where that is allowed. */
bool kmp_words_operand(kmp_program_reader *r, bool sign, uint32_t *operand);

#endif
