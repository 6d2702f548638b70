/* SPDX-License-Identifier: BSD-3-Clause */
#include "symbolic/program/program_words.h"
#include <math.h>
#include <stdarg.h>
#include <string.h>

enum { MOST_INDEX = 10000000 };

const char *const kmp_input_words[KMP_IN_COUNT] = {"p",    "t",     "q",     "qd",    "qdd",    "lambda", "mu",
                                                   "mode", "place", "chart", "force", "torque", "effort", "along"};

/* -- words ------------------------------------------------------------------------------------------- */

void kmp_words_skip(kmp_program_reader *r)
{
    r->at += strspn(r->at, " \t\r");
}

bool kmp_words_complain(kmp_program_reader *r, const char *format, ...)
{
    kmp_text sentence = {0};
    va_list arguments;
    va_start(arguments, format);
    kmp_text_vprintf(&sentence, format, arguments);
    va_end(arguments);
    int column = (int)(r->at - r->line_start) + 1;
    if (r->status == KEMPE_OK)
        r->status = sentence.failed ? kmp_fail_memory(r->context)
                                    : kmp_complain(r->context, r->file, r->line, column, "%s", sentence.s);
    kmp_text_free(&sentence);
    return false;
}

bool kmp_words_no_memory(kmp_program_reader *r)
{
    if (r->status == KEMPE_OK)
        r->status = kmp_fail_memory(r->context);
    return false;
}

/* True if the text continues with these characters, which are then skipped. */
bool kmp_words_take(kmp_program_reader *r, const char *word)
{
    kmp_words_skip(r);
    size_t n = strlen(word);
    if (strncmp(r->at, word, n) != 0)
        return false;
    r->at += n;
    return true;
}

bool kmp_words_want(kmp_program_reader *r, const char *word)
{
    return kmp_words_take(r, word) || kmp_words_complain(r, "'%s' is expected here", word);
}

static bool is_letter(char c)
{
    return (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z');
}

size_t kmp_words_letters(const char *s)
{
    size_t n = 0;
    while (is_letter(s[n]))
        n++;
    return n;
}

/* Skips the word of letters and digits if it is this one. */
bool kmp_words_take_word(kmp_program_reader *r, const char *word)
{
    kmp_words_skip(r);
    size_t n = strlen(word);
    if (strncmp(r->at, word, n) != 0 || is_letter(r->at[n]))
        return false;
    r->at += n;
    return true;
}

bool kmp_words_index(kmp_program_reader *r, uint32_t *index)
{
    kmp_words_skip(r);
    if (*r->at < '0' || *r->at > '9')
        return kmp_words_complain(r, "an integer is expected here");
    for (*index = 0; *r->at >= '0' && *r->at <= '9'; r->at++) {
        *index = 10 * *index + (uint32_t)(*r->at - '0');
        if (*index > MOST_INDEX)
            return kmp_words_complain(r, "a number of at most %d is expected here", MOST_INDEX);
    }
    return true;
}

bool kmp_words_number(kmp_program_reader *r, double *value)
{
    kmp_words_skip(r);
    bool negative = *r->at == '-';
    r->at += negative;
    if (kmp_words_take_word(r, "inf")) {
        *value = INFINITY;
    } else if (kmp_words_take_word(r, "nan")) {
        *value = NAN;
    } else {
        size_t n = kmp_text_to_number(r->at, value);
        if (n == 0)
            return kmp_words_complain(r, "a number is expected here");
        r->at += n;
    }
    *value = negative ? -*value : *value;
    return true;
}

/* To the first line that is not empty. */
void kmp_words_skip_lines(kmp_program_reader *r)
{
    do {
        r->line_start = ++r->at;
        r->line++;
        kmp_words_skip(r);
    } while (*r->at == '\n');
}

bool kmp_words_next_line(kmp_program_reader *r)
{
    kmp_words_skip(r);
    if (*r->at == '\0')
        return kmp_words_complain(r, "the program is not finished: 'end' is expected");
    if (*r->at != '\n')
        return kmp_words_complain(r, "the end of the line is expected here");
    kmp_words_skip_lines(r);
    return true;
}

/* -- operands ---------------------------------------------------------------------------------------- */

static uint32_t tagged(int class, uint32_t index)
{
    return ((uint32_t) class << KMP_CLASS_SHIFT | index) << 1;
}

/* The first slot in which a key is searched. */
static size_t slot_of(const kmp_program_reader *r, uint64_t key)
{
    return (size_t)((key * 0x9e3779b97f4a7c15u) >> 20) & (r->constant_size - 1);
}

static uint32_t constant_operand(kmp_program_reader *r, double value)
{
    uint64_t bits;
    memcpy(&bits, &value, sizeof bits);
    size_t k = slot_of(r, bits);
    for (; r->constant[k]; k = (k + 1) & (r->constant_size - 1))
        if (memcmp(&r->p->constant[r->constant[k] - 1], &value, sizeof value) == 0)
            return tagged(KMP_OF_CONSTANT, r->constant[k] - 1);
    r->p->constant[r->p->constant_count++] = value;
    r->constant[k] = (uint32_t)r->p->constant_count;
    return tagged(KMP_OF_CONSTANT, r->constant[k] - 1);
}

static uint32_t input_operand(kmp_program_reader *r, kmp_input_kind kind, uint32_t index)
{
    kmp_program *p = r->p;
    size_t k = slot_of(r, (uint64_t)index << 8 | (uint64_t)kind);
    for (; r->input[k]; k = (k + 1) & (r->constant_size - 1)) {
        const kmp_program_input *known = &p->input[r->input[k] - 1];
        if (known->kind == kind && known->index == index)
            return tagged(KMP_OF_INPUT, r->input[k] - 1);
    }
    p->input[p->input_count++] = (kmp_program_input){kind, index};
    r->input[k] = (uint32_t)p->input_count;
    return tagged(KMP_OF_INPUT, r->input[k] - 1);
}

/* v12, q[3], t */
static bool read_variable(kmp_program_reader *r, uint32_t *operand)
{
    uint32_t index = 0;
    if (kmp_words_take_word(r, "v")) {
        if (!kmp_words_index(r, &index))
            return false;
        *operand = tagged(KMP_OF_INSTRUCTION, index);
        return index < (uint32_t)r->code || kmp_words_complain(r, "v%u is not defined yet", index);
    }
    for (int kind = 0; kind < KMP_IN_COUNT; kind++) {
        if (!kmp_words_take_word(r, kmp_input_words[kind]))
            continue;
        bool alone = kind == KMP_IN_TIME && *r->at != '[';
        if (!alone && !(kmp_words_want(r, "[") && kmp_words_index(r, &index) && kmp_words_want(r, "]")))
            return false;
        *operand = input_operand(r, (kmp_input_kind)kind, index);
        return true;
    }
    return kmp_words_complain(r, "an operand is expected here: a number, an input or a value v..");
}

bool kmp_words_operand(kmp_program_reader *r, bool sign, uint32_t *operand)
{
    double value;
    kmp_words_skip(r);
    bool negative = *r->at == '-';
    if (negative && !sign)
        return kmp_words_complain(r, "a sign is not allowed here");
    r->at += negative;
    kmp_words_skip(r);
    if (is_letter(*r->at) && strncmp(r->at, "inf", 3) != 0 && strncmp(r->at, "nan", 3) != 0) {
        if (!read_variable(r, operand))
            return false;
    } else {
        if (*r->at == '-')
            return kmp_words_complain(r, "duplicate sign");
        if (!kmp_words_number(r, &value))
            return false;
        *operand = constant_operand(r, value);
    }
    *operand |= negative;
    return true;
}
