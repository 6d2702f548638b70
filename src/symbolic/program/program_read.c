/* SPDX-License-Identifier: BSD-3-Clause */
/* Programs from their text: docs/program_format.md. One function for each rule of its grammar, one line after another;
 * the first error ends the reading. All arrays have the length that the text can require, so none grows. */
#include "symbolic/implicit.h"
#include "symbolic/program/program.h"
#include "symbolic/program/program_words.h"
#include "symbolic/table_function.h"
#include <string.h>

/* -- lines ------------------------------------------------------------------------------------------- */

/* The function whose name is at the current position, KMP_OP_COUNT when there is none. */
static kmp_op function_here(const kmp_program_reader *r)
{
    size_t n = kmp_words_letters(r->at);
    while (n && r->at[n] >= '0' && r->at[n] <= '9')
        n++;
    for (int op = 0; op < KMP_OP_COUNT; op++) {
        const char *text = kmp_op_text((kmp_op)op);
        if (kmp_op_form_of((kmp_op)op) >= KMP_FORM_FUNCTION && strlen(text) == n && strncmp(text, r->at, n) == 0)
            return (kmp_op)op;
    }
    return KMP_OP_COUNT;
}

static bool read_applied(kmp_program_reader *r, kmp_instruction *in)
{
    if (!(kmp_words_want(r, "[") && kmp_words_index(r, &in->b)))
        return false;
    bool block = in->op == KMP_OP_IMPLICIT;
    if (in->b >= (uint32_t)(block ? r->p->block_count : r->p->table_count))
        return kmp_words_complain(r, "unknown %s %u", block ? "implicit block" : "table", in->b);
    if (!kmp_words_want(r, ",") || !kmp_words_index(r, &in->c))
        return false;
    if (block && in->c >= (uint32_t)r->p->block[in->b].unknowns)
        return kmp_words_complain(r, "the block has no unknown %u", in->c);
    return kmp_words_want(r, "]");
}

/* An implicit block takes a list of its arguments. */
static bool check_list(kmp_program_reader *r, const kmp_instruction *in)
{
    uint32_t list = in->a;
    for (int l = 0; l < r->p->block[in->b].arguments; l++) {
        uint32_t at = (list >> 1) & (((uint32_t)1 << KMP_CLASS_SHIFT) - 1);
        bool value = list >> 1 >> KMP_CLASS_SHIFT == KMP_OF_INSTRUCTION && !(list & 1);
        if (!value || r->p->instruction[at].op != KMP_OP_LIST)
            return kmp_words_complain(r, "a list of %d arguments is expected", r->p->block[in->b].arguments);
        list = r->p->instruction[at].b;
    }
    return true;
}

static bool read_function(kmp_program_reader *r, kmp_op op, kmp_instruction *in)
{
    uint32_t operand[3] = {0};
    int arity = kmp_op_arity(op);
    *in = (kmp_instruction){.op = (uint8_t)op};
    r->at += strlen(kmp_op_text(op));
    if (kmp_op_form_of(op) == KMP_FORM_APPLIED && !read_applied(r, in))
        return false;
    for (int k = 0; k < arity; k++)
        if (!kmp_words_want(r, k ? "," : "(") || !kmp_words_operand(r, true, &operand[k]))
            return false;
    in->a = operand[0];
    if (arity > 1)
        in->b = operand[1];
    if (arity > 2)
        in->c = operand[2];
    return (op != KMP_OP_IMPLICIT || check_list(r, in)) && kmp_words_want(r, ")");
}

static bool read_infix(kmp_program_reader *r, kmp_instruction *in)
{
    if (!kmp_words_operand(r, false, &in->a))
        return false;
    bool minus = kmp_words_take(r, "-");
    if (minus || kmp_words_take(r, "+"))
        in->op = KMP_OP_ADD;
    else if (kmp_words_take(r, "*"))
        in->op = KMP_OP_MUL;
    else if (kmp_words_take(r, "/"))
        in->op = KMP_OP_DIV;
    else
        return kmp_words_complain(r, "'+', '-', '*' or '/' is expected here");
    if (!kmp_words_operand(r, false, &in->b))
        return false;
    in->b |= minus;
    return true;
}

static bool read_instruction(kmp_program_reader *r)
{
    uint32_t number = 0;
    kmp_instruction in = {0};
    const char *start = r->at;
    if (!kmp_words_index(r, &number) || !kmp_words_want(r, "="))
        return false;
    if (number != (uint32_t)r->code) {
        r->at = start;
        return kmp_words_complain(r, "v%d is expected next, not v%u", r->code, number);
    }
    kmp_words_skip(r);
    kmp_op op = function_here(r);
    if (op < KMP_OP_COUNT ? !read_function(r, op, &in) : !read_infix(r, &in))
        return false;
    r->p->instruction[r->code++] = in;
    return kmp_words_next_line(r);
}

static bool read_output(kmp_program_reader *r, int first)
{
    uint32_t number = 0;
    if (!kmp_words_want(r, "[") || !kmp_words_index(r, &number) || !kmp_words_want(r, "]") || !kmp_words_want(r, "="))
        return false;
    if (number != (uint32_t)(r->outputs - first))
        return kmp_words_complain(r, "out[%d] is expected next, not out[%u]", r->outputs - first, number);
    if (!kmp_words_operand(r, true, &r->p->output[r->outputs]))
        return false;
    r->outputs++;
    return kmp_words_next_line(r);
}

/* The number of the next table, block or stage. */
static bool read_number(kmp_program_reader *r, const char *what, int next)
{
    uint32_t number = 0;
    if (!kmp_words_index(r, &number))
        return false;
    return number == (uint32_t)next || kmp_words_complain(r, "%s %d is expected next, not %u", what, next, number);
}

/* "stage" has been read. A name may follow the number. */
static bool read_stage(kmp_program_reader *r)
{
    kmp_program *p = r->p;
    if (!read_number(r, "stage", p->stages))
        return false;
    r->at += strcspn(r->at, "\n");
    p->code[p->stages] = r->code;
    p->outputs[p->stages++] = r->outputs;
    int first = r->outputs;
    if (!kmp_words_next_line(r))
        return false;
    while (kmp_words_take_word(r, "v"))
        if (!read_instruction(r))
            return false;
    while (kmp_words_take_word(r, "out"))
        if (!read_output(r, first))
            return false;
    return true;
}

static bool starts_number(const kmp_program_reader *r)
{
    return *r->at == '-' || *r->at == '.' || (*r->at >= '0' && *r->at <= '9');
}

/* "table" has been read. */
static bool read_table(kmp_program_reader *r)
{
    int count = 0, method = 0, number = r->p->table_count;
    if (!read_number(r, "table", r->p->table_count))
        return false;
    while (method < KMP_TABLE_METHODS && !kmp_words_take_word(r, kmp_table_method_name((kmp_table_method)method)))
        method++;
    if (method == KMP_TABLE_METHODS)
        return kmp_words_complain(r, "'linear' or 'cubic' is expected here");
    if (!kmp_words_next_line(r))
        return false;
    while (starts_number(r)) {
        if (!kmp_words_number(r, &r->x[count]) || !kmp_words_number(r, &r->y[count]))
            return false;
        count++;
        if (!kmp_words_next_line(r))
            return false;
    }
    if (kmp_table_check(count, r->x, r->y) >= 0)
        return kmp_words_complain(r, "a table has at least two finite points, with x increasing");
    kmp_table *table = kmp_table_new((kmp_table_method)method, count, r->x, r->y);
    int added = table ? kmp_program_add_table(r->p, table) : -1;
    kmp_table_free(table);
    if (added < 0)
        return kmp_words_no_memory(r);
    return added == number || kmp_words_complain(r, "table %d is the same as table %d", number, added);
}

static kempe_status read_program(kmp_program_reader *r, kmp_program **program);

/* Checks averages: the exponent and the averaged expressions, at the place q[0]. */
static bool check_averages(kmp_program_reader *r, const kmp_program_block *block)
{
    const kmp_program *p = block->program;
    if (block->candidates < 3)
        return kmp_words_complain(r, "averages need at least three positions");
    if (p->stages != 3 || p->outputs[1] != 0 || p->outputs[2] != 2 || p->outputs[3] != block->unknowns + 1)
        return kmp_words_complain(r, "a block of averages has 2 outputs in stage 1 and %d in stage 2",
                                  block->unknowns - 1);
    return true;
}

static bool check_equations(kmp_program_reader *r, const kmp_program_block *block)
{
    const kmp_program *p = block->program;
    int n = block->unknowns;
    bool among = block->candidates > 0;
    int last = n + n * n + (among && n == 1);
    if (p->stages != 3 + among || p->outputs[1] != 0 || p->outputs[2] != n || (among && p->outputs[3] != n + 1) ||
        p->outputs[p->stages] != n + among + last)
        return kmp_words_complain(r, "an implicit block has %d outputs in stage 1%s and %d in stage %d", n,
                                  among ? ", 1 in stage 2" : "", last, 2 + among);
    return true;
}

/* Checks that the block's program has a guess of each unknown, then residuals and derivatives, and reads unknowns q and
 * arguments p alone. */
static bool check_block(kmp_program_reader *r, const kmp_program_block *block)
{
    const kmp_program *p = block->program;
    int n = block->averages ? 1 : block->unknowns;
    if (!(block->averages ? check_averages(r, block) : check_equations(r, block)))
        return false;
    for (int k = 0; k < p->input_count; k++) {
        int count = p->input[k].kind == KMP_IN_Q ? n : p->input[k].kind == KMP_IN_PARAMETER ? block->arguments : 0;
        if (p->input[k].index >= (uint32_t)count)
            return kmp_words_complain(r, "an implicit block has access to its unknowns q and arguments p only");
    }
    return true;
}

/* Numbers, one a line, into x. */
static bool read_candidates(kmp_program_reader *r, kmp_program_block *block)
{
    int *count = &block->candidates;
    block->candidate = r->x;
    while (starts_number(r)) {
        const char *start = r->at;
        if (!kmp_words_number(r, &r->x[*count]))
            return false;
        if (*count > 0 && !(r->x[*count] >= r->x[*count - 1])) {
            r->at = start;
            return kmp_words_complain(r, "candidates must not decrease");
        }
        (*count)++;
        if (!kmp_words_next_line(r))
            return false;
    }
    return true;
}

/* "implicit" has been read. */
static bool read_block(kmp_program_reader *r)
{
    uint32_t unknowns = 0, arguments = 0;
    if (r->around)
        return kmp_words_complain(r, "an implicit block cannot contain blocks");
    if (!read_number(r, "implicit", r->p->block_count))
        return false;
    bool averages = kmp_words_take_word(r, "averages");
    if (!(averages || kmp_words_want(r, "unknowns")) || !kmp_words_index(r, &unknowns) ||
        !kmp_words_want(r, "arguments") || !kmp_words_index(r, &arguments))
        return false;
    if (unknowns < 1 || (unknowns > KMP_IMPLICIT_MOST && !averages))
        return kmp_words_complain(r, "an implicit block has 1 to %d unknowns", KMP_IMPLICIT_MOST);
    kmp_program_block block = {.unknowns = (int)unknowns, .arguments = (int)arguments, .averages = averages};
    if (!kmp_words_next_line(r) || !read_candidates(r, &block))
        return false;
    kmp_program_reader inner = {
        .context = r->context, .file = r->file, .at = r->at, .line_start = r->line_start, .line = r->line};
    inner.around = r;
    r->status = read_program(&inner, &block.program);
    if (r->status != KEMPE_OK)
        return false;
    r->at = inner.at;
    r->line_start = inner.line_start;
    r->line = inner.line;
    bool ok = check_block(r, &block) && (kmp_program_add_block(r->p, &block) >= 0 || kmp_words_no_memory(r));
    kmp_program_free(block.program);
    return ok && kmp_words_next_line(r);
}

/* -- the whole --------------------------------------------------------------------------------------- */

static void number_operand(const kmp_program *p, uint32_t *operand)
{
    static const uint32_t mask = ((uint32_t)1 << KMP_CLASS_SHIFT) - 1;
    uint32_t value = *operand >> 1, class = value >> KMP_CLASS_SHIFT;
    value &= mask;
    if (class >= KMP_OF_INPUT)
        value += (uint32_t)p->constant_count;
    if (class == KMP_OF_INSTRUCTION)
        value += (uint32_t)p->input_count;
    *operand = value << 1 | (*operand & 1);
}

/* Constants first, then inputs, then instructions. */
static void number_operands(kmp_program_reader *r)
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

static bool read_body(kmp_program_reader *r)
{
    if (!kmp_words_want(r, "program 1") || !kmp_words_next_line(r))
        return false;
    while (kmp_words_take_word(r, "table"))
        if (!read_table(r))
            return false;
    while (kmp_words_take_word(r, "implicit"))
        if (!read_block(r))
            return false;
    while (kmp_words_take_word(r, "stage"))
        if (!read_stage(r))
            return false;
    if (!kmp_words_take_word(r, "end"))
        return kmp_words_complain(r,
                                  r->p->stages ? "a value 'v%d', an output, 'stage' or 'end' is expected here"
                                               : "'table', 'implicit' or 'stage' is expected here",
                                  r->code);
    if (r->p->stages == 0)
        return kmp_words_complain(r, "a program needs at least stage 0");
    r->p->code[r->p->stages] = r->code;
    r->p->outputs[r->p->stages] = r->outputs;
    number_operands(r);
    return true;
}

/* Lines of an implicit block end at its "end"; those of the whole program may be anywhere. */
static size_t count_lines(const kmp_program_reader *r, const char *text)
{
    size_t lines = 2;
    for (const char *s = text; *s; s++) {
        if (*s != '\n')
            continue;
        lines++;
        const char *word = s + 1 + strspn(s + 1, " \t\r");
        if (r->around && strncmp(word, "end", 3) == 0)
            break;
    }
    return lines;
}

static bool begin(kmp_program_reader *r, const char *text)
{
    size_t lines = count_lines(r, text);
    for (r->constant_size = 64; r->constant_size < 6 * lines + 2;)
        r->constant_size *= 2;
    r->constant = KMP_ARENA_NEW(&r->arena, uint32_t, r->constant_size);
    r->input = KMP_ARENA_NEW(&r->arena, uint32_t, r->constant_size);
    r->x = KMP_ARENA_NEW(&r->arena, double, lines);
    r->y = KMP_ARENA_NEW(&r->arena, double, lines);
    r->p = kmp_program_with_room(lines, lines, lines, 3 * lines, 3 * lines);
    if (r->arena.failed || !r->p)
        return kmp_words_no_memory(r);
    bool long_text = !r->around && strlen(text) >= (size_t)1 << 30;
    if (long_text || lines >= (size_t)1 << (KMP_CLASS_SHIFT - 3))
        return kmp_words_complain(r, "the program is too long");
    return true;
}

/* Reads up to and including "end"; nothing may follow the "end" of the whole text. */
static kempe_status read_program(kmp_program_reader *r, kmp_program **program)
{
    if (begin(r, r->at) && read_body(r) && !r->around) {
        kmp_words_skip(r);
        if (*r->at == '\n')
            kmp_words_skip_lines(r);
        if (*r->at != '\0')
            (void)kmp_words_complain(r, "nothing may follow 'end'");
    }
    kmp_arena_free(&r->arena);
    if (r->status == KEMPE_OK)
        *program = r->p;
    else
        kmp_program_free(r->p);
    return r->status;
}

kempe_status kmp_program_read(kempe_context *context, const char *file, const char *text, kmp_program **program)
{
    kmp_program_reader r = {.context = context, .file = file, .at = text, .line_start = text, .line = 1};
    return read_program(&r, program);
}
