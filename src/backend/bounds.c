/* SPDX-License-Identifier: BSD-3-Clause */
/* The operations that outputs of a program with known bounds need, in its order. */
#include "backend/bounds.h"
#include "linalg/piece_bounds.h"
#include "symbolic/table_function.h"
#include <math.h>
#include <string.h>

bool kmp_bounds_is_solved(const kmp_bounds *b, int k)
{
    int i = (int)(b->program->output[k] >> 1) - b->program->constant_count - b->program->input_count;
    return i >= 0 && b->program->instruction[i].op == KMP_OP_IMPLICIT;
}

/* Properties of a value: its bounds are computable, a given value is needed for it, outputs need it; and its number. */
typedef struct knowledge {
    bool known, given, needed;
    uint32_t number;
} knowledge;

/* The number of operands that are values. */
static int operands(const kmp_instruction *in)
{
    return in->op == KMP_OP_IMPLICIT ? 0 : kmp_op_arity((kmp_op)in->op);
}

static uint32_t renumbered(const knowledge *value, uint32_t operand)
{
    return value[operand >> 1].number << 1 | (operand & 1);
}

/* Lists the operations that are needed. */
static void put_code(kmp_bounds *b, kmp_bound_step *step, knowledge *value)
{
    const kmp_program *p = b->program;
    const int first = p->constant_count + p->input_count;
    for (int i = 0; i < first; i++)
        value[i].number = (uint32_t)i;
    for (int i = 0; i < p->code[p->stages]; i++) {
        const kmp_instruction *in = &p->instruction[i];
        if (!value[first + i].needed)
            continue;
        const int count = operands(in);
        const bool table = in->op == KMP_OP_TABLE;
        value[first + i].number = (uint32_t)(first + b->code.steps);
        step[b->code.steps++] = (kmp_bound_step){.op = in->op,
                                                 .a = count > 0 ? renumbered(value, in->a) : 0,
                                                 .b = table       ? in->b
                                                      : count > 1 ? renumbered(value, in->b)
                                                                  : 0,
                                                 .c = table       ? in->c
                                                      : count > 2 ? renumbered(value, in->c)
                                                                  : 0};
        b->code.fixed += i < p->code[1];
    }
    for (int k = 0; k < p->outputs[p->stages]; k++)
        b->output[k] = b->known[k] ? renumbered(value, p->output[k]) : 0;
}

static int bound_table(const void *tables, unsigned number, int derivative, double from, double to, double *low,
                       double *high)
{
    const kmp_table *table = ((const kmp_program *)tables)->table[number];
    kmp_table_bounds(table, derivative, from, to, low, high);
    if (kmp_table_degree(table) == 1)
        return 1;
    return kmp_bends_smoothly(table->count, table->x, table->piece[0], from, to) ? 3 : 2;
}

kmp_bounds *kmp_bounds_new(const kmp_program *program, kmp_arena *arena)
{
    kmp_bounds *r = KMP_ARENA_NEW(arena, kmp_bounds, 1);
    if (!r)
        return NULL;
    const int operations = program->code[program->stages], outputs = program->outputs[program->stages];
    const int values = program->constant_count + program->input_count + operations;
    knowledge *marks = KMP_ARENA_NEW(arena, knowledge, values);
    kmp_bound_step *step = KMP_ARENA_NEW(arena, kmp_bound_step, operations);
    *r = (kmp_bounds){.program = program,
                      .code = {.constants = program->constant_count,
                               .inputs = program->input_count,
                               .constant = program->constant,
                               .step = step,
                               .tables = program,
                               .table = bound_table}};
    if (!KMP_ARENA_MAKE(arena, KMP_ROOM(uint32_t, outputs, &r->output), KMP_ROOM(bool, outputs, &r->known, &r->given),
                        KMP_ROOM(bool, values, &r->needed), KMP_ROOM(bool, program->input_count, &r->chooses),
                        KMP_ROOM(int, operations, &r->listed), KMP_ROOM(kmp_bound, values, &r->value)))
        return NULL;
    /* Values whose bounds follow from operands, and values that are given. */
    const kmp_program *p = r->program;
    const int first = p->constant_count + p->input_count;
    for (int i = 0; i < first; i++)
        marks[i].known = true;
    for (int k = 0; k < p->outputs[p->stages]; k++)
        if (kmp_bounds_is_solved(r, k))
            marks[p->output[k] >> 1] = (knowledge){.known = true, .given = true};
    for (int i = 0; i < p->code[p->stages]; i++) {
        const kmp_instruction *in = &p->instruction[i];
        knowledge *now = &marks[first + i];
        if (in->op == KMP_OP_IMPLICIT)
            continue;
        now->known = in->op != KMP_OP_LIST;
        for (int k = 0; k < operands(in); k++) {
            const knowledge *operand = &marks[kmp_instruction_operand(in, k) >> 1];
            now->known = now->known && operand->known;
            now->given = now->given || operand->given;
        }
    }
    /* The values that known outputs need. */
    for (int k = 0; k < p->outputs[p->stages]; k++) {
        knowledge *out = &marks[p->output[k] >> 1];
        r->known[k] = out->known;
        r->given[k] = out->given;
        out->needed = out->needed || out->known;
    }
    for (int i = p->code[p->stages]; i-- > 0;)
        for (int k = 0; marks[first + i].needed && k < operands(&p->instruction[i]); k++)
            marks[kmp_instruction_operand(&p->instruction[i], k) >> 1].needed = true;
    put_code(r, step, marks);
    for (int k = 0; k < r->code.steps; k++) {
        const int input = (int)(step[k].a >> 1) - r->code.constants;
        if (step[k].op == KMP_OP_SELECT && input >= 0 && input < r->code.inputs)
            r->chooses[input] = true;
    }
    return r;
}

void kmp_bounds_set(kmp_bounds *bounds, int k, kmp_bound bound)
{
    bounds->value[bounds->code.constants + k] = bound;
}

void kmp_bounds_run(kmp_bounds *r, bool constants)
{
    kmp_bound_code code = r->code;
    code.listed = NULL;
    kmp_bound_run(&code, constants ? 0 : code.fixed, r->value);
}

/* Among the operations that are looked at. */
void kmp_bounds_want(kmp_bounds *r, int count, const int *output, const bool *wanted)
{
    const kmp_bound_code *code = &r->code;
    const int first = code->constants + code->inputs;
    memset(r->needed, 0, (size_t)first * sizeof *r->needed);
    if (code->listed)
        for (int i = 0; i < code->count; i++)
            r->needed[first + code->listed[i]] = false;
    else
        memset(r->needed + first, 0, (size_t)(kmp_bound_values(code) - first) * sizeof *r->needed);
    for (int k = 0; k < count; k++)
        if (wanted[k] && r->known[output[k]])
            r->needed[r->output[output[k]] >> 1] = true;
    kmp_bound_mark(code, r->value, r->needed);
}

void kmp_bounds_run_wanted(kmp_bounds *r)
{
    kmp_bound_code code = r->code;
    code.needed = r->needed;
    kmp_bound_run(&code, code.fixed, r->value);
}

void kmp_bounds_limit(kmp_bounds *r, int count, const int *output, const bool *among)
{
    kmp_bound_code *code = &r->code;
    const int first = code->constants + code->inputs;
    code->listed = NULL;
    if (!among)
        return;
    kmp_bounds_want(r, count, output, among);
    code->count = 0;
    for (int k = code->fixed; k < code->steps; k++)
        if (r->needed[first + k])
            r->listed[code->count++] = k;
    code->listed = r->listed;
}

kmp_bound kmp_bounds_get(const kmp_bounds *bounds, int k)
{
    static const kmp_bound anything = {-INFINITY, INFINITY, -INFINITY, INFINITY};
    return bounds->known[k] ? kmp_bound_of(bounds->value, bounds->output[k]) : anything;
}
