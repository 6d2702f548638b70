/* SPDX-License-Identifier: BSD-3-Clause */
/* Steps of a program: the longest chain of named variables, found in one loop through the instructions. A value that is
 * used once is a part of the expression that uses it, and no step of its own. */
#include "studies/show/steps.h"

typedef struct work {
    const kmp_program *p;
    int leaves;
    int *uses;
    long *index; /* the largest one below an instruction; of a variable its own */
    bool *angle; /* a sum of inputs */
} work;

static void count_uses(work *w, int count)
{
    const kmp_program *p = w->p;
    for (int i = 0; i < count; i++)
        for (int k = 0; k < kmp_op_arity((kmp_op)p->instruction[i].op); k++) {
            int value = (int)(kmp_instruction_operand(&p->instruction[i], k) >> 1);
            if (value >= w->leaves)
                w->uses[value - w->leaves]++;
        }
    for (int k = 0; k < p->outputs[p->stages]; k++) {
        int value = (int)(p->output[k] >> 1);
        if (value >= w->leaves)
            w->uses[value - w->leaves] += 2; /* has a name of its own */
    }
}

/* True for values available before the first step: functions of parameters, sums of inputs, their sines and cosines. */
static bool is_known(const work *w, int i)
{
    const kmp_instruction *in = &w->p->instruction[i];
    int value = (int)(in->a >> 1);
    if (i < w->p->code[1])
        return true;
    return (in->op == KMP_OP_SIN || in->op == KMP_OP_COS) && (value < w->leaves || w->angle[value - w->leaves]);
}

static long index_of(const work *w, int i)
{
    const kmp_instruction *in = &w->p->instruction[i];
    long index = 0;
    if (is_known(w, i))
        return 0;
    for (int k = 0; k < kmp_op_arity((kmp_op)in->op); k++) {
        int value = (int)(kmp_instruction_operand(in, k) >> 1);
        if (value >= w->leaves && w->index[value - w->leaves] > index)
            index = w->index[value - w->leaves];
    }
    return w->uses[i] > 1 ? index + 1 : index;
}

kmp_steps kmp_program_steps(const kmp_program *p)
{
    int count = p->code[p->stages];
    kmp_arena arena = {0};
    kmp_steps steps = {.vector = -1};
    work w = {.p = p,
              .leaves = p->constant_count + p->input_count,
              .uses = KMP_ARENA_NEW(&arena, int, count),
              .index = KMP_ARENA_NEW(&arena, long, count),
              .angle = KMP_ARENA_NEW(&arena, bool, count)};
    if (!arena.failed) {
        steps.vector = 0;
        count_uses(&w, count);
    }
    for (int i = 0; !arena.failed && i < count; i++) {
        const kmp_instruction *in = &p->instruction[i];
        bool sum = in->op == KMP_OP_ADD || in->op == KMP_OP_MUL;
        for (int k = 0; sum && k < kmp_op_arity((kmp_op)in->op); k++) {
            int value = (int)(kmp_instruction_operand(in, k) >> 1);
            sum = value < w.leaves || w.angle[value - w.leaves];
        }
        w.angle[i] = sum;
        w.index[i] = index_of(&w, i);
        steps.serial += w.uses[i] > 1 && !is_known(&w, i);
        if (w.index[i] > steps.vector)
            steps.vector = w.index[i];
    }
    kmp_arena_free(&arena);
    return steps;
}
