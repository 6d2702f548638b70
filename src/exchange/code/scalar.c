/* SPDX-License-Identifier: BSD-3-Clause */
/* Text of expressions with the fewest brackets that keep the order of operations. Values used more than once, or too
 * long for a line, become variables; long routines are cut into chunks. */
#include "exchange/code/scalar.h"
#include "base/memory.h"
#include "base/text.h"
#include "exchange/code/block_parts.h"
#include "exchange/code/write.h"
#include "symbolic/ops.h"
#include <stdio.h>
#include <string.h>

enum { LONGEST = 90, LEAF_LENGTH = 8 };

/* The precedence of an operand's position. */
typedef enum place { PLACE_TOP, PLACE_LEFT_TERM, PLACE_RIGHT_TERM, PLACE_LEFT_FACTOR, PLACE_RIGHT_FACTOR } place;

/* The instruction of this stage behind an operand, -1 for a value available before it. */
static int instruction_of(const kmp_scalar *s, uint32_t operand)
{
    int i = (int)(operand >> 1) - s->leaves;
    return i >= s->p->code[s->stage] ? i : -1;
}

/* -- sinks ------------------------------------------------------------------------------------------- */

static void add_sink(kmp_scalar *s, kmp_sink sink)
{
    int i = instruction_of(s, sink.operand);
    sink.next = -1;
    if (i >= 0) {
        sink.next = s->sink[i];
        s->sink[i] = s->sink_count;
    }
    s->sinks[s->sink_count++] = sink;
}

static void add_array(kmp_scalar *s, int array)
{
    const kmp_array *a = &s->routine->arrays[array];
    const uint32_t *output = s->p->output + s->p->outputs[1] + a->first;
    for (int row = 0; row < a->rows; row++) {
        int cols = a->symmetric ? row + 1 : a->cols ? a->cols : 1;
        for (int col = 0; col < cols; col++)
            add_sink(s, (kmp_sink){.operand = *output++, .array = array, .row = row, .col = a->cols ? col : -1});
    }
}

static void add_sinks(kmp_scalar *s)
{
    const kmp_code_routine *r = s->routine;
    int values = s->leaves + s->p->code[s->p->stages];
    for (int a = 0; s->stage > 0 && a < r->array_count; a++)
        add_array(s, a);
    for (int v = 0; s->stage == 0 && v < values; v++)
        if (r->kept[v])
            add_sink(s, (kmp_sink){.operand = (uint32_t)v << 1, .array = -1, .row = r->kept[v] - 1, .col = -1});
}

/* True if a sink's entry keeps its initial value, zero. */
static bool is_zero(const kmp_scalar *s, const kmp_sink *sink)
{
    int value = (int)(sink->operand >> 1);
    return value < s->p->constant_count && s->p->constant[value] == 0;
}

/* A sink that no statement serves: a number, an input, something of an earlier stage. */
static bool is_leaf(const kmp_scalar *s, const kmp_sink *sink)
{
    return instruction_of(s, sink->operand) < 0;
}

bool kmp_scalar_has_zeros(const kmp_scalar *s, int array)
{
    for (int k = 0; k < s->sink_count; k++)
        if (s->sinks[k].array == array && is_zero(s, &s->sinks[k]))
            return true;
    return false;
}

/* -- variables --------------------------------------------------------------------------------------- */

static void count_uses(kmp_scalar *s)
{
    const kmp_program *p = s->p;
    for (int i = p->code[s->stage]; i < p->code[s->stage + 1]; i++)
        for (int k = 0; k < kmp_op_arity((kmp_op)p->instruction[i].op); k++) {
            int used = instruction_of(s, kmp_instruction_operand(&p->instruction[i], k));
            if (used >= 0)
                s->uses[used]++;
        }
    for (int k = 0; k < s->sink_count; k++)
        if (!is_leaf(s, &s->sinks[k]))
            s->uses[instruction_of(s, s->sinks[k].operand)]++;
}

static bool is_angle_function(const kmp_program *p, int i)
{
    return p->instruction[i].op == KMP_OP_SIN || p->instruction[i].op == KMP_OP_COS;
}

/* Chooses variables: an expression that is used more than once, or would make a line too long, gets one. Operands
 * precede their users. */
static void choose_variables(kmp_scalar *s)
{
    const kmp_program *p = s->p;
    for (int i = p->code[s->stage]; i < p->code[s->stage + 1]; i++) {
        s->length[i] = 5;
        for (int k = 0; k < kmp_op_arity((kmp_op)p->instruction[i].op); k++) {
            uint32_t operand = kmp_instruction_operand(&p->instruction[i], k);
            int j = instruction_of(s, operand);
            s->length[i] += j < 0 || s->variable[j] ? LEAF_LENGTH : s->length[j];
        }
        s->variable[i] = s->uses[i] > 1 || s->length[i] > LONGEST || is_angle_function(p, i);
        if (p->instruction[i].op == KMP_OP_LIST)
            s->variable[i] = 0;
        if (p->instruction[i].op == KMP_OP_IMPLICIT)
            s->variable[i] = 1;
    }
}

/* -- statements -------------------------------------------------------------------------------------- */

/* The sine that belongs to a cosine, or the reverse, where it comes later. */
static int partner_of(const kmp_scalar *s, int i)
{
    const kmp_instruction *in = &s->p->instruction[i];
    for (int k = i + 1; k < s->p->code[s->stage + 1] && k < i + 64; k++)
        if (is_angle_function(s->p, k) && s->p->instruction[k].a == in->a && s->p->instruction[k].op != in->op)
            return k;
    return -1;
}

static void list_statements(kmp_scalar *s)
{
    const kmp_program *p = s->p;
    int chunk = s->language->chunk;
    for (int i = p->code[s->stage]; i < p->code[s->stage + 1]; i++) {
        bool paired = s->language->pair && is_angle_function(p, i);
        if (s->first_chunk[i] >= 0 || (!s->variable[i] && s->sink[i] < 0))
            continue;
        kmp_statement *st = &s->statements[s->count];
        *st = (kmp_statement){i, paired ? partner_of(s, i) : -1, chunk ? s->count / chunk : 0};
        s->first_chunk[i] = st->chunk;
        if (s->variable[i])
            s->variable[i] = ++s->variables;
        if (st->partner >= 0) {
            s->first_chunk[st->partner] = st->chunk;
            s->variable[st->partner] = ++s->variables;
        }
        s->count++;
    }
    s->chunks = s->count ? s->statements[s->count - 1].chunk + 1 : 1;
}

static void note_reading(kmp_scalar *s, uint32_t operand, int chunk)
{
    int i = instruction_of(s, operand);
    if (i < 0)
        return;
    if (s->variable[i]) {
        s->last_chunk[i] = chunk;
        return;
    }
    for (int k = 0; k < kmp_op_arity((kmp_op)s->p->instruction[i].op); k++)
        note_reading(s, kmp_instruction_operand(&s->p->instruction[i], k), chunk);
}

/* Variables that are read in a later chunk than they are set get a slot, which others take over once it is free. */
static bool give_slots(kmp_scalar *s)
{
    int *stack = KMP_ARENA_NEW(&s->arena, int, s->count * 2 + 1), depth = 0, chunk = 0, freed = 0;
    int *order = KMP_ARENA_NEW(&s->arena, int, s->count * 2 + 1),
        open = 0; /* variables with slots that are still read */
    for (int k = 0; !s->arena.failed && k < s->count; k++) {
        const kmp_statement *st = &s->statements[k];
        if (st->chunk > chunk) {
            chunk = st->chunk;
            freed = 0;
            for (int j = 0; j < open; j++) {
                if (s->last_chunk[order[j]] < chunk)
                    stack[depth++] = s->slot[order[j]];
                else
                    order[freed++] = order[j];
            }
            open = freed;
        }
        const int set[2] = {st->value, st->partner};
        for (int j = 0; j < 2; j++)
            if (set[j] >= 0 && s->variable[set[j]] && s->last_chunk[set[j]] > chunk) {
                s->slot[set[j]] = depth > 0 ? stack[--depth] : ++s->slots;
                order[open++] = set[j];
            }
    }
    return !s->arena.failed;
}

static void find_readings(kmp_scalar *s)
{
    for (int k = 0; k < s->count; k++) {
        const kmp_statement *st = &s->statements[k];
        const kmp_instruction *in = &s->p->instruction[st->value];
        for (int j = 0; j < kmp_op_arity((kmp_op)in->op); j++)
            note_reading(s, kmp_instruction_operand(in, j), st->chunk);
    }
}

/* Names that are taken, by hash: open addressing over numbers of instructions + 1. */
typedef struct taken {
    int *slot;
    size_t size; /* a power of two */
} taken;

/* True when the name is new and now taken by instruction i. */
static bool take(taken *t, char *const *name, const char *wanted, int i)
{
    size_t k = kmp_text_hash(wanted) & (t->size - 1);
    for (; t->slot[k]; k = (k + 1) & (t->size - 1))
        if (strcmp(name[t->slot[k] - 1], wanted) == 0)
            return false;
    t->slot[k] = i + 1;
    return true;
}

/* -- sines and cosines ------------------------------------------------------------------------------- */

/* "1p2m3" of a sum of coordinates; false for any other operand. */
static bool put_angle(const kmp_program *p, uint32_t operand, bool minus, bool first, int depth, kmp_text *text)
{
    int value = (int)(operand >> 1), input = value - p->constant_count, i = input - p->input_count;
    minus = minus != (bool)(operand & 1);
    if (input >= 0 && i < 0 && p->input[input].kind == KMP_IN_Q) {
        kmp_text_printf(text, "%s%u", minus ? "m" : first ? "" : "p", p->input[input].index + 1);
        return true;
    }
    return i >= 0 && depth < 5 && p->instruction[i].op == KMP_OP_ADD &&
           put_angle(p, p->instruction[i].a, minus, first, depth + 1, text) &&
           put_angle(p, p->instruction[i].b, minus, false, depth + 1, text);
}

/* -- names ------------------------------------------------------------------------------------------- */

static bool put_label(const kmp_program *p, int i, kmp_text *text)
{
    const kmp_label *label = p->label ? &p->label[i] : NULL;
    if (!label || !label->quantity)
        return false;
    kmp_text_put(text, label->quantity->stem);
    if (label->entry)
        kmp_text_printf(text, "%d", label->entry);
    kmp_text_printf(text, "%d", label->link);
    if (label->column)
        kmp_text_printf(text, "_%d", label->column);
    kmp_text_put(text, label->negative ? "n" : ""); /* the negative of the named value */
    return true;
}

static void propose(const kmp_scalar *s, int i, int *others, kmp_text *text)
{
    const kmp_instruction *in = &s->p->instruction[i];
    if (in->op == KMP_OP_SIN || in->op == KMP_OP_COS) {
        kmp_text_put(text, in->op == KMP_OP_SIN ? "S" : "C");
        if (put_angle(s->p, in->a, false, true, 0, text) || text->failed)
            return;
        kmp_text_free(text);
    }
    if (put_label(s->p, i, text) || text->failed)
        return;
    kmp_text_free(text);
    kmp_text_printf(text, "a%d", ++*others);
}

static bool give_one(kmp_scalar *s, taken *t, int i, int *others)
{
    kmp_text text = {0};
    propose(s, i, others, &text);
    for (int again = 2; !text.failed && !take(t, s->name, text.s, i); again++) {
        text.length = strcspn(text.s, "x");
        text.s[text.length] = '\0';
        kmp_text_printf(&text, "x%d", again);
    }
    s->name[i] = kmp_text_keep(&text, &s->arena);
    return s->name[i];
}

/* Names for reading of all variables of a stage, each once: S1, C1, S1p2 for sines and cosines of coordinates, OM12 for
 * labelled values, a1, a2 .. for all others. false: no memory. */
static bool give_names(kmp_scalar *s)
{
    taken t = {.size = 64};
    int others = 0;
    while (t.size < 2 * (size_t)s->variables + 2)
        t.size *= 2;
    t.slot = KMP_ARENA_NEW(&s->arena, int, t.size);
    s->name = KMP_ARENA_NEW(&s->arena, char *, s->p->code[s->p->stages]);
    bool ok = t.slot && s->name;
    for (int k = 0; ok && k < s->count; k++) {
        const int set[2] = {s->statements[k].value, s->statements[k].partner};
        for (int j = 0; j < 2 && ok; j++)
            ok = set[j] < 0 || !s->variable[set[j]] || give_one(s, &t, set[j], &others);
    }
    return ok;
}

bool kmp_scalar_init(kmp_scalar *s, const kmp_code_source *source, const kmp_code_routine *routine, int stage,
                     const kmp_language *language)
{
    const kmp_program *p = routine->program;
    int code = p->code[p->stages], leaves = p->constant_count + p->input_count;
    *s = (kmp_scalar){
        .source = source, .routine = routine, .p = p, .language = language, .stage = stage, .leaves = leaves};
    int **const arrays[] = {&s->uses, &s->length, &s->variable, &s->first_chunk, &s->last_chunk, &s->slot, &s->sink};
    for (size_t k = 0; k < sizeof arrays / sizeof *arrays; k++)
        *arrays[k] = KMP_ARENA_NEW(&s->arena, int, code);
    s->statements = KMP_ARENA_NEW(&s->arena, kmp_statement, code);
    s->sinks = KMP_ARENA_NEW(&s->arena, kmp_sink, p->outputs[p->stages] + routine->kept_count);
    bool ok = !s->arena.failed;
    if (ok) {
        for (int i = 0; i < code; i++)
            s->first_chunk[i] = s->last_chunk[i] = s->sink[i] = -1;
        add_sinks(s);
        count_uses(s);
        choose_variables(s);
        list_statements(s);
        find_readings(s);
        ok = give_slots(s) && (!source->legible || give_names(s));
    }
    if (!ok)
        kmp_scalar_free(s);
    return ok;
}

KMP_CLEARS(kmp_scalar, s, kmp_arena_free(&s->arena))

/* -- writing ----------------------------------------------------------------------------------------- */

static void put_index(kmp_text *text, const kmp_language *language, const char *name, int index)
{
    kmp_text_printf(text, "%s%c%d%c", name, language->open, index + language->base, language->close);
}

static void put_variable(kmp_scalar *s, kmp_text *text, int i)
{
    s->slots_used = s->slots_used || s->slot[i];
    if (s->slot[i])
        put_index(text, s->language, "w", s->slot[i] - 1);
    else if (s->name)
        kmp_text_put(text, s->name[i]);
    else
        kmp_text_printf(text, "v%d", s->variable[i]);
}

static bool binds_loosely(kmp_op op, const kmp_language *language, place at)
{
    if (op == KMP_OP_ADD)
        return at >= PLACE_RIGHT_TERM;
    if (op == KMP_OP_MUL || (op == KMP_OP_DIV && !language->divides_by_call))
        return at == PLACE_RIGHT_FACTOR;
    return false;
}

static void put_expression(kmp_scalar *s, kmp_text *text, int i);

static void put_input(kmp_scalar *s, kmp_text *text, const kmp_program_input *in)
{
    int argument = kmp_argument_of(in);
    s->used |= 1u << argument;
    if (argument == KMP_IN_TIME)
        kmp_text_put(text, "t");
    else
        put_index(text, s->language, argument == KMP_IN_PARAMETER ? "p" : kmp_argument_names[argument],
                  argument == KMP_IN_PARAMETER ? s->source->place[in->index] : kmp_place_in_argument(s->source, in));
}

/* Writes a value that is available before the stage. */
static void put_leaf(kmp_scalar *s, kmp_text *text, int value)
{
    const kmp_program *p = s->p;
    int kept = s->stage > 0 && value >= p->constant_count ? s->routine->kept[value] : 0;
    if (kept) {
        s->used |= 1u << KMP_IN_PARAMETER;
        put_index(text, s->language, "k", kept - 1);
    } else if (value < p->constant_count) {
        kmp_language_number(text, s->language, p->constant[value]);
    } else {
        put_input(s, text, &p->input[value - p->constant_count]);
    }
}

static void put_operand(kmp_scalar *s, kmp_text *text, uint32_t operand, place at)
{
    int i = instruction_of(s, operand);
    bool here = i >= 0 && !s->variable[i]; /* written in place */
    bool parentheses =
        operand & 1 ? at > PLACE_TOP : here && binds_loosely((kmp_op)s->p->instruction[i].op, s->language, at);
    kmp_text_put(text, parentheses ? "(" : "");
    if (operand & 1) {
        kmp_text_put(text, "-");
        put_operand(s, text, operand ^ 1u, PLACE_RIGHT_FACTOR);
    } else if (here) {
        put_expression(s, text, i);
    } else if (i >= 0) {
        put_variable(s, text, i);
    } else {
        put_leaf(s, text, (int)(operand >> 1));
    }
    kmp_text_put(text, parentheses ? ")" : "");
}

static kmp_code_writer writer_of(const kmp_scalar *s, kmp_text *text)
{
    return (kmp_code_writer){.text = text, .language = s->language, .source = s->source, .routine = s->routine};
}

static void put_expression(kmp_scalar *s, kmp_text *text, int i)
{
    const kmp_instruction *in = &s->p->instruction[i];
    if (in->op == KMP_OP_IMPLICIT) {
        char solved[32];
        snprintf(solved, sizeof solved, "y%d", s->variable[s->solved]);
        put_index(text, s->language, solved, (int)in->c);
        return;
    }
    bool infix = kmp_op_form_of((kmp_op)in->op) == KMP_FORM_INFIX;
    if (infix && !(in->op == KMP_OP_DIV && s->language->divides_by_call)) {
        bool sum = in->op == KMP_OP_ADD, minus = sum && (in->b & 1);
        put_operand(s, text, in->a, sum ? PLACE_LEFT_TERM : PLACE_LEFT_FACTOR);
        kmp_text_put(text, minus ? " - " : sum ? " + " : kmp_op_text((kmp_op)in->op));
        put_operand(s, text, minus ? in->b ^ 1u : in->b, sum ? PLACE_RIGHT_TERM : PLACE_RIGHT_FACTOR);
    } else {
        const kmp_language *language = s->language;
        bool table = in->op == KMP_OP_TABLE;
        kmp_code_writer w = writer_of(s, text);
        w.table = table ? (int)in->b : 0;
        w.derivative = table ? (int)in->c : 0;
        if (!table && language->call)
            language->call(&w, (kmp_op)in->op);
        else
            kmp_fill(&w, table ? language->table_call : language->functions[in->op].call);
        kmp_text_put(text, table ? "" : "(");
        for (int k = 0; k < kmp_op_arity((kmp_op)in->op); k++) {
            kmp_text_put(text, k ? ", " : "");
            put_operand(s, text, kmp_instruction_operand(in, k), PLACE_TOP);
        }
        kmp_text_put(text, ")");
    }
}

/* -- statements -------------------------------------------------------------------------------------- */

static void put_entry(kmp_text *text, const kmp_language *t, const kmp_array *a, int row, int col)
{
    if (col < 0)
        put_index(text, t, a->name, row);
    else if (t->flat)
        put_index(text, t, a->name, row * a->cols + col);
    else
        kmp_text_printf(text, "%s%c%d, %d%c", a->name, t->open, row + t->base, col + t->base, t->close);
}

/* True if the entry belongs to the other half of a symmetric matrix. */
static bool is_mirrored(const kmp_scalar *s, const kmp_sink *sink)
{
    return sink->array >= 0 && s->routine->arrays[sink->array].symmetric && sink->row != sink->col;
}

/* "M[3] = M[7] = " */
static void put_places(kmp_scalar *s, kmp_text *text, const kmp_sink *sink)
{
    kmp_text_put(text, "    ");
    if (sink->array < 0) {
        put_index(text, s->language, "k", sink->row);
    } else {
        const kmp_array *a = &s->routine->arrays[sink->array];
        put_entry(text, s->language, a, sink->row, sink->col);
        if (is_mirrored(s, sink) && s->language->chains) {
            kmp_text_put(text, " = ");
            put_entry(text, s->language, a, sink->col, sink->row);
        }
    }
    kmp_text_put(text, " = ");
}

static unsigned put_sink(kmp_scalar *s, kmp_text *text, const kmp_sink *sink)
{
    put_places(s, text, sink);
    put_operand(s, text, sink->operand, PLACE_TOP);
    kmp_text_printf(text, "%s\n", s->language->end);
    if (is_mirrored(s, sink) && !s->language->chains) {
        const kmp_array *a = &s->routine->arrays[sink->array];
        kmp_text_put(text, "    ");
        put_entry(text, s->language, a, sink->col, sink->row);
        kmp_text_put(text, " = ");
        put_entry(text, s->language, a, sink->row, sink->col);
        kmp_text_printf(text, "%s\n", s->language->end);
    }
    return sink->array >= 0 ? 1u << sink->array : 0;
}

static unsigned put_sinks(kmp_scalar *s, kmp_text *text, int instruction)
{
    unsigned arrays = 0;
    for (int k = s->sink[instruction]; k >= 0; k = s->sinks[k].next)
        arrays |= put_sink(s, text, &s->sinks[k]);
    return arrays;
}

/* Sine and cosine at once; a local variable for each that is not needed or has a slot. */
static void put_pair(kmp_scalar *s, kmp_text *text, const kmp_statement *st)
{
    const kmp_instruction *in = &s->p->instruction[st->value];
    bool sine = in->op == KMP_OP_SIN;
    const int set[2] = {sine ? st->value : st->partner, sine ? st->partner : st->value};
    kmp_text angle = {0}, name[2] = {{0}, {0}};
    kmp_code_writer w = writer_of(s, text);
    put_operand(s, &angle, in->a, PLACE_TOP);
    for (int k = 0; k < 2; k++)
        if (set[k] < 0 || s->slot[set[k]])
            kmp_text_printf(&name[k], "%c%d", "sc"[k], s -> variable[st->value]);
        else
            put_variable(s, &name[k], set[k]);
    w.angle = angle.s;
    w.sine = name[0].s;
    w.cosine = name[1].s;
    kmp_fill(&w, s->language->pair);
    for (int k = 0; k < 2; k++)
        if (set[k] >= 0 && s->slot[set[k]]) {
            kmp_text_put(text, "    ");
            put_variable(s, text, set[k]);
            kmp_text_printf(text, " = %s%s\n", name[k].s ? name[k].s : "", s->language->end);
        }
    kmp_text_free_part(text, &angle);
    kmp_text_free_part(text, &name[0]);
    kmp_text_free_part(text, &name[1]);
}

/* The call that solves a block; its unknowns are next to each other. */
static void put_solution(kmp_scalar *s, kmp_text *text, int i)
{
    const kmp_instruction *in = &s->p->instruction[i], *last = s->solved >= 0 ? &s->p->instruction[s->solved] : NULL;
    const kmp_program_block *block = &s->p->block[in->b];
    if (last && last->a == in->a && last->b == in->b)
        return;
    kmp_text list = {0}, what = {0};
    for (int k = 0; k < block->arguments; k++) {
        const uint32_t item = kmp_code_block_item(s->p, in->a, k);
        kmp_text_put(&list, k ? ", " : "");
        if (item == UINT32_MAX)
            kmp_text_put(&list, "0.0");
        else
            put_operand(s, &list, item, PLACE_TOP);
    }
    s->solved = i;
    kmp_text_printf(&what, "y%d", s->variable[i]);
    kmp_code_writer w = writer_of(s, text);
    w.argument = list.s;
    w.what = what.s;
    w.count = block->unknowns;
    w.number = (int)in->b;
    kmp_fill(&w, s->language->solve);
    kmp_text_free_part(text, &list);
    kmp_text_free_part(text, &what);
}

/* A line where another quantity or link begins. */
static void put_heading(kmp_scalar *s, kmp_text *text, int instruction)
{
    const kmp_label *label = s->name && s->p->label ? &s->p->label[instruction] : NULL;
    if (!label || !label->quantity)
        return;
    if (!s->label || s->label->quantity != label->quantity || s->label->link != label->link ||
        s->label->column != label->column)
        kmp_text_printf(text, label->column ? "    %s link %d, %s of motion %d%s\n" : "    %s link %d, %s%.0d%s\n",
                        s->language->comment, label->link, label->quantity->meaning, label->column,
                        s->language->comment_end);
    s->label = label;
}

static unsigned put_statement(kmp_scalar *s, kmp_text *text, const kmp_statement *st)
{
    put_heading(s, text, st->value);
    if (s->p->instruction[st->value].op == KMP_OP_IMPLICIT)
        put_solution(s, text, st->value);
    if (s->language->pair && is_angle_function(s->p, st->value)) {
        put_pair(s, text, st);
    } else if (s->variable[st->value]) {
        kmp_text_printf(text, "    %s", s->slot[st->value] ? "" : s->language->local);
        put_variable(s, text, st->value);
        kmp_text_put(text, " = ");
        put_expression(s, text, st->value);
        kmp_text_put(text, s->language->end);
        if (s->name && s->slot[st->value])
            kmp_text_printf(text, " %s %s%s", s->language->comment, s->name[st->value], s->language->comment_end);
        kmp_text_put(text, "\n");
    }
    unsigned arrays = put_sinks(s, text, st->value);
    return st->partner >= 0 ? arrays | put_sinks(s, text, st->partner) : arrays;
}

unsigned kmp_scalar_chunk(kmp_scalar *s, kmp_text *text, int chunk, int *at)
{
    unsigned arrays = 0;
    s->used = 0;
    s->slots_used = false;
    s->solved = -1;
    for (; *at < s->count && s->statements[*at].chunk == chunk; ++*at)
        arrays |= put_statement(s, text, &s->statements[*at]);
    for (int k = 0; chunk == s->chunks - 1 && k < s->sink_count; k++)
        if (is_leaf(s, &s->sinks[k]) && !is_zero(s, &s->sinks[k]))
            arrays |= put_sink(s, text, &s->sinks[k]);
    return arrays;
}
