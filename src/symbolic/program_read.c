/* SPDX-License-Identifier: BSD-3-Clause */
/* Programs from their text: docs/program_format.md. One function a rule of its grammar, one line after another; the
 * first mistake ends the reading. All arrays are as long as the text can ask for, so nothing grows. */
#include "base/context.h"
#include "base/memory.h"
#include "symbolic/program.h"
#include "symbolic/program_words.h"
#include "symbolic/table.h"
#include <math.h>
#include <stdarg.h>
#include <string.h>

enum { MOST_INDEX = 10000000 };

/* Until all are known, operands carry in their highest bits what they number. */
enum { OF_CONSTANT, OF_INPUT, OF_INSTRUCTION, CLASS_SHIFT = 29 };

typedef struct reader {
    kempe_context *context;
    const char *file, *at, *line_start;
    int line;
    kempe_status status;
    kmp_program *p;
    int code, outputs;  /* so far */
    uint32_t *constant; /* hash table of constants: number + 1 */
    size_t constant_size;
    double *x, *y; /* points of a table */
} reader;

/* -- words ------------------------------------------------------------------------------------------- */

static void skip_space(reader *r)
{
    r->at += strspn(r->at, " \t\r");
}

__attribute__((format(printf, 2, 3))) static bool complain(reader *r, const char *format, ...)
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

static bool no_memory(reader *r)
{
    if (r->status == KEMPE_OK)
        r->status = kmp_fail_memory(r->context);
    return false;
}

/* Whether the text goes on with these characters, which are then passed. */
static bool take(reader *r, const char *word)
{
    skip_space(r);
    size_t n = strlen(word);
    if (strncmp(r->at, word, n) != 0)
        return false;
    r->at += n;
    return true;
}

static bool want(reader *r, const char *word)
{
    return take(r, word) || complain(r, "'%s' is wanted here", word);
}

static bool is_letter(char c)
{
    return (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z');
}

static size_t letters(const char *s)
{
    size_t n = 0;
    while (is_letter(s[n]))
        n++;
    return n;
}

/* The word of letters and digits, passed only when it is this one. */
static bool take_word(reader *r, const char *word)
{
    skip_space(r);
    size_t n = strlen(word);
    if (strncmp(r->at, word, n) != 0 || is_letter(r->at[n]))
        return false;
    r->at += n;
    return true;
}

static bool read_index(reader *r, uint32_t *index)
{
    skip_space(r);
    if (*r->at < '0' || *r->at > '9')
        return complain(r, "a whole number is wanted here");
    for (*index = 0; *r->at >= '0' && *r->at <= '9'; r->at++) {
        *index = 10 * *index + (uint32_t)(*r->at - '0');
        if (*index > MOST_INDEX)
            return complain(r, "a number of at most %d is wanted here", MOST_INDEX);
    }
    return true;
}

static bool read_number(reader *r, double *value)
{
    skip_space(r);
    bool negative = *r->at == '-';
    r->at += negative;
    if (take_word(r, "inf")) {
        *value = INFINITY;
    } else if (take_word(r, "nan")) {
        *value = NAN;
    } else {
        size_t n = kmp_text_to_number(r->at, value);
        if (n == 0)
            return complain(r, "a number is wanted here");
        r->at += n;
    }
    *value = negative ? -*value : *value;
    return true;
}

/* To the first line that is not empty. */
static void skip_lines(reader *r)
{
    do {
        r->line_start = ++r->at;
        r->line++;
        skip_space(r);
    } while (*r->at == '\n');
}

static bool next_line(reader *r)
{
    skip_space(r);
    if (*r->at == '\0')
        return complain(r, "the program is not finished: 'end' is wanted");
    if (*r->at != '\n')
        return complain(r, "the end of the line is wanted here");
    skip_lines(r);
    return true;
}

/* -- operands ---------------------------------------------------------------------------------------- */

static uint32_t tagged(int class, uint32_t index)
{
    return ((uint32_t) class << CLASS_SHIFT | index) << 1;
}

static uint32_t constant_operand(reader *r, double value)
{
    uint64_t bits;
    memcpy(&bits, &value, sizeof bits);
    size_t k = (size_t)((bits * 0x9e3779b97f4a7c15u) >> 20) & (r->constant_size - 1);
    for (; r->constant[k]; k = (k + 1) & (r->constant_size - 1))
        if (memcmp(&r->p->constant[r->constant[k] - 1], &value, sizeof value) == 0)
            return tagged(OF_CONSTANT, r->constant[k] - 1);
    r->p->constant[r->p->constant_count++] = value;
    r->constant[k] = (uint32_t)r->p->constant_count;
    return tagged(OF_CONSTANT, r->constant[k] - 1);
}

static uint32_t input_operand(reader *r, kmp_input_kind kind, uint32_t index)
{
    kmp_program *p = r->p;
    for (int k = 0; k < p->input_count; k++)
        if (p->input[k].kind == kind && p->input[k].index == index)
            return tagged(OF_INPUT, (uint32_t)k);
    p->input[p->input_count] = (kmp_program_input){kind, index};
    return tagged(OF_INPUT, (uint32_t)p->input_count++);
}

/* v12, q[3], t */
static bool read_variable(reader *r, uint32_t *operand)
{
    uint32_t index = 0;
    if (take_word(r, "v")) {
        if (!read_index(r, &index))
            return false;
        *operand = tagged(OF_INSTRUCTION, index);
        return index < (uint32_t)r->code || complain(r, "v%u is not known yet", index);
    }
    for (int kind = 0; kind < KMP_IN_COUNT; kind++) {
        if (!take_word(r, kmp_input_words[kind]))
            continue;
        if (kind != KMP_IN_TIME && !(want(r, "[") && read_index(r, &index) && want(r, "]")))
            return false;
        *operand = input_operand(r, (kmp_input_kind)kind, index);
        return true;
    }
    return complain(r, "an operand is wanted here: a number, an input or a value v..");
}

static bool read_operand(reader *r, bool sign, uint32_t *operand)
{
    double value;
    skip_space(r);
    bool negative = *r->at == '-';
    if (negative && !sign)
        return complain(r, "a sign is not allowed here");
    r->at += negative;
    skip_space(r);
    if (is_letter(*r->at) && strncmp(r->at, "inf", 3) != 0 && strncmp(r->at, "nan", 3) != 0) {
        if (!read_variable(r, operand))
            return false;
    } else {
        if (*r->at == '-')
            return complain(r, "one sign is enough");
        if (!read_number(r, &value))
            return false;
        *operand = constant_operand(r, value);
    }
    *operand |= negative;
    return true;
}

/* -- lines ------------------------------------------------------------------------------------------- */

/* The function whose name stands here, KMP_OP_COUNT when it is none. */
static kmp_op function_here(const reader *r)
{
    size_t n = letters(r->at);
    while (n && r->at[n] >= '0' && r->at[n] <= '9')
        n++;
    for (int op = 0; op < KMP_OP_COUNT; op++) {
        const char *text = kmp_op_text((kmp_op)op);
        if (kmp_op_form_of((kmp_op)op) >= KMP_FORM_FUNCTION && strlen(text) == n && strncmp(text, r->at, n) == 0)
            return (kmp_op)op;
    }
    return KMP_OP_COUNT;
}

static bool read_applied(reader *r, kmp_instruction *in)
{
    if (!(want(r, "[") && read_index(r, &in->b)))
        return false;
    if (in->b >= (uint32_t)r->p->table_count)
        return complain(r, "there is no table %u", in->b);
    return want(r, ",") && read_index(r, &in->c) && want(r, "]");
}

static bool read_function(reader *r, kmp_op op, kmp_instruction *in)
{
    uint32_t operand[3] = {0};
    int arity = kmp_op_arity(op);
    *in = (kmp_instruction){.op = (uint8_t)op};
    r->at += strlen(kmp_op_text(op));
    if (kmp_op_form_of(op) == KMP_FORM_APPLIED && !read_applied(r, in))
        return false;
    for (int k = 0; k < arity; k++)
        if (!want(r, k ? "," : "(") || !read_operand(r, true, &operand[k]))
            return false;
    in->a = operand[0];
    if (arity > 1)
        in->b = operand[1];
    if (arity > 2)
        in->c = operand[2];
    return want(r, ")");
}

static bool read_infix(reader *r, kmp_instruction *in)
{
    if (!read_operand(r, false, &in->a))
        return false;
    bool minus = take(r, "-");
    if (minus || take(r, "+"))
        in->op = KMP_OP_ADD;
    else if (take(r, "*"))
        in->op = KMP_OP_MUL;
    else if (take(r, "/"))
        in->op = KMP_OP_DIV;
    else
        return complain(r, "'+', '-', '*' or '/' is wanted here");
    if (!read_operand(r, false, &in->b))
        return false;
    in->b |= minus;
    return true;
}

static bool read_instruction(reader *r)
{
    uint32_t number = 0;
    kmp_instruction in = {0};
    const char *start = r->at;
    if (!read_index(r, &number) || !want(r, "="))
        return false;
    if (number != (uint32_t)r->code) {
        r->at = start;
        return complain(r, "v%d comes next, not v%u", r->code, number);
    }
    skip_space(r);
    kmp_op op = function_here(r);
    if (op < KMP_OP_COUNT ? !read_function(r, op, &in) : !read_infix(r, &in))
        return false;
    r->p->instruction[r->code++] = in;
    return next_line(r);
}

static bool read_output(reader *r, int first)
{
    uint32_t number = 0;
    if (!want(r, "[") || !read_index(r, &number) || !want(r, "]") || !want(r, "="))
        return false;
    if (number != (uint32_t)(r->outputs - first))
        return complain(r, "out[%d] comes next, not out[%u]", r->outputs - first, number);
    if (!read_operand(r, true, &r->p->output[r->outputs]))
        return false;
    r->outputs++;
    return next_line(r);
}

/* "stage" has been read. A name may follow the number. */
static bool read_stage(reader *r)
{
    kmp_program *p = r->p;
    uint32_t number = 0;
    if (!read_index(r, &number))
        return false;
    if (number != (uint32_t)p->stages)
        return complain(r, "stage %d comes next, not %u", p->stages, number);
    r->at += strcspn(r->at, "\n");
    p->code[p->stages] = r->code;
    p->outputs[p->stages++] = r->outputs;
    int first = r->outputs;
    if (!next_line(r))
        return false;
    while (take_word(r, "v"))
        if (!read_instruction(r))
            return false;
    while (take_word(r, "out"))
        if (!read_output(r, first))
            return false;
    return true;
}

/* "table" has been read. */
static bool read_table(reader *r)
{
    uint32_t number = 0;
    int count = 0, method = 0;
    if (!read_index(r, &number))
        return false;
    if (number != (uint32_t)r->p->table_count)
        return complain(r, "table %d comes next, not %u", r->p->table_count, number);
    while (method < KMP_TABLE_METHODS && !take_word(r, kmp_table_method_name((kmp_table_method)method)))
        method++;
    if (method == KMP_TABLE_METHODS)
        return complain(r, "'linear' or 'cubic' is wanted here");
    if (!next_line(r))
        return false;
    while (*r->at == '-' || *r->at == '.' || (*r->at >= '0' && *r->at <= '9')) {
        if (!read_number(r, &r->x[count]) || !read_number(r, &r->y[count]))
            return false;
        count++;
        if (!next_line(r))
            return false;
    }
    if (kmp_table_check(count, r->x, r->y) >= 0)
        return complain(r, "a table has at least two finite points, with x increasing");
    kmp_table *table = kmp_table_new((kmp_table_method)method, count, r->x, r->y);
    int added = table ? kmp_program_add_table(r->p, table) : -1;
    kmp_table_free(table);
    if (added < 0)
        return no_memory(r);
    return added == (int)number || complain(r, "table %u is table %d again", number, added);
}

/* -- the whole --------------------------------------------------------------------------------------- */

static void number_operand(const kmp_program *p, uint32_t *operand)
{
    static const uint32_t mask = ((uint32_t)1 << CLASS_SHIFT) - 1;
    uint32_t value = *operand >> 1, class = value >> CLASS_SHIFT;
    value &= mask;
    if (class >= OF_INPUT)
        value += (uint32_t)p->constant_count;
    if (class == OF_INSTRUCTION)
        value += (uint32_t)p->input_count;
    *operand = value << 1 | (*operand & 1);
}

/* Constants first, then inputs, then instructions. */
static void number_operands(reader *r)
{
    for (int i = 0; i < r->code; i++) {
        kmp_instruction *in = &r->p->instruction[i];
        int arity = kmp_op_arity((kmp_op)in->op);
        number_operand(r->p, &in->a);
        if (arity > 1)
            number_operand(r->p, &in->b);
        if (arity > 2)
            number_operand(r->p, &in->c);
    }
    for (int k = 0; k < r->outputs; k++)
        number_operand(r->p, &r->p->output[k]);
}

static bool read_body(reader *r)
{
    if (!want(r, "program 1") || !next_line(r))
        return false;
    while (take_word(r, "table"))
        if (!read_table(r))
            return false;
    while (take_word(r, "stage"))
        if (!read_stage(r))
            return false;
    if (!take_word(r, "end"))
        return complain(r,
                        r->p->stages ? "a value 'v%d', an output, 'stage' or 'end' is wanted here"
                                     : "'table' or 'stage' is wanted here",
                        r->code);
    if (r->p->stages == 0)
        return complain(r, "a program has at least stage 0");
    r->p->code[r->p->stages] = r->code;
    r->p->outputs[r->p->stages] = r->outputs;
    number_operands(r);
    return true;
}

static bool begin(reader *r, const char *text)
{
    size_t lines = 2, length = strlen(text);
    for (const char *s = text; *s; s++)
        lines += *s == '\n';
    for (r->constant_size = 64; r->constant_size < 6 * lines + 2;)
        r->constant_size *= 2;
    r->constant = KMP_NEW(uint32_t, r->constant_size);
    r->x = KMP_NEW(double, lines);
    r->y = KMP_NEW(double, lines);
    r->p = KMP_NEW(kmp_program, 1);
    if (!r->constant || !r->x || !r->y || !r->p)
        return no_memory(r);
    if (lines >= (size_t)1 << (CLASS_SHIFT - 3) || length >= (size_t)1 << 30)
        return complain(r, "the program is too long");
    r->p->code = KMP_NEW(int, lines);
    r->p->outputs = KMP_NEW(int, lines);
    r->p->output = KMP_NEW(uint32_t, lines);
    r->p->instruction = KMP_NEW(kmp_instruction, lines);
    r->p->constant = KMP_NEW(double, 3 * lines);
    r->p->input = KMP_NEW(kmp_program_input, 3 * lines);
    bool ok = r->p->code && r->p->outputs && r->p->output && r->p->instruction && r->p->constant && r->p->input;
    return ok || no_memory(r);
}

kempe_status kmp_program_read(kempe_context *context, const char *file, const char *text, kmp_program **program)
{
    reader r = {.context = context, .file = file, .at = text, .line_start = text, .line = 1};
    if (begin(&r, text) && read_body(&r)) {
        skip_space(&r);
        if (*r.at == '\n')
            skip_lines(&r);
        if (*r.at != '\0')
            (void)complain(&r, "nothing may follow 'end'");
    }
    kmp_free(r.constant);
    kmp_free(r.x);
    kmp_free(r.y);
    if (r.status == KEMPE_OK)
        *program = r.p;
    else
        kmp_program_free(r.p);
    return r.status;
}
