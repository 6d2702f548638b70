/* SPDX-License-Identifier: BSD-3-Clause */
#include "generate/blocks/place_values.h"
#include "base/memory.h"
#include "symbolic/program/interpreter.h"
#include <string.h>

/* True for constants, the place, and the instructions before i that depend on these alone. */
static bool stands(const kmp_program *p, const bool *standing, uint32_t operand)
{
    const int value = (int)(operand >> 1), leaves = p->constant_count + p->input_count;
    if (value < p->constant_count)
        return true;
    if (value >= leaves)
        return standing[value - leaves];
    const kmp_program_input *in = &p->input[value - p->constant_count];
    return in->kind == KMP_IN_Q && in->index == 0;
}

/* q has room for the unknowns, of which those after the first are zero: no value depends on them. */
static bool evaluate(const kmp_program *p, double *q, int places, const double *place, const int *list,
                     kmp_place_values *values)
{
    const int leaves = p->constant_count + p->input_count;
    kmp_interpreter *code = kmp_interpreter_new(p);
    for (int at = 0; code && at < places; at++) {
        double *row = values->rows + (ptrdiff_t)at * values->width;
        q[0] = place[at];
        kmp_interpreter_set(code, KMP_IN_Q, q);
        for (int stage = 0; stage < p->stages; stage++)
            (void)kmp_interpreter_run(code, stage);
        row[0] = place[at];
        for (int k = 1; k < values->width; k++)
            row[k] = kmp_interpreter_values(code)[leaves + list[k - 1]];
    }
    kmp_interpreter_free(code);
    return code;
}

kmp_program *kmp_place_values_take(const kmp_program *p, int unknowns, kmp_arena *arena, int places,
                                   const double *place, kmp_place_values *values)
{
    const size_t code = (size_t)p->code[p->stages];
    bool *standing = KMP_NEW(bool, code + 1);
    int *list = KMP_NEW(int, code + 1), count = 0;
    double *q = KMP_NEW(double, unknowns);
    kmp_program *found = NULL;
    if (standing && list && q) {
        for (int i = 0; i < p->code[p->stages]; i++) {
            standing[i] = i >= p->code[1];
            for (int k = 0; k < kmp_op_arity((kmp_op)p->instruction[i].op); k++)
                standing[i] = standing[i] && stands(p, standing, kmp_instruction_operand(&p->instruction[i], k));
        }
        found = kmp_program_given(p, standing, unknowns, list, &count);
    }
    values->width = 1 + count;
    values->rows = KMP_ARENA_NEW(arena, double, (size_t)places *(size_t)values->width);
    if (found && !(values->rows && evaluate(p, q, places, place, list, values))) {
        kmp_program_free(found);
        found = NULL;
    }
    kmp_free(standing);
    kmp_free(list);
    kmp_free(q);
    return found;
}
