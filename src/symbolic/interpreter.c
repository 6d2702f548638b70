/* SPDX-License-Identifier: BSD-3-Clause */
/* The interpreter of programs: one array of values, and one switch for the five operations that most instructions are.
 * All others go through kmp_program_value, the definition of every operation, so that bits equal the bits of the
 * back ends. */
#include "symbolic/interpreter.h"
#include "base/memory.h"
#include "symbolic/table_function.h"
#include <math.h>
#include <string.h>

struct kmp_interpreter {
    const kmp_program *p;
    kmp_arena arena;
    double *v; /* constants, inputs, instructions */
    double *out;
};

kmp_interpreter *kmp_interpreter_new(const kmp_program *p)
{
    kmp_interpreter *it = KMP_NEW(kmp_interpreter, 1);
    if (!it)
        return NULL;
    it->p = p;
    it->v = KMP_ARENA_NEW(&it->arena, double, p->constant_count + p->input_count + p->code[p->stages]);
    it->out = KMP_ARENA_NEW(&it->arena, double, p->outputs[p->stages]);
    if (it->arena.failed) {
        kmp_interpreter_free(it);
        return NULL;
    }
    memcpy(it->v, p->constant, (size_t)p->constant_count * sizeof(double));
    return it;
}

void kmp_interpreter_free(kmp_interpreter *it)
{
    if (!it)
        return;
    kmp_arena_free(&it->arena);
    kmp_free(it);
}

void kmp_interpreter_set(kmp_interpreter *it, kmp_input_kind kind, const double *values)
{
    const kmp_program *p = it->p;
    for (int k = 0; k < p->input_count; k++)
        if (p->input[k].kind == kind)
            it->v[p->constant_count + k] = values[p->input[k].index];
}

/* The value of an operand with its sign, by inversion of the highest bit. */
static inline double operand(const double *v, uint32_t operand_)
{
    uint64_t bits;
    double value;
    memcpy(&bits, &v[operand_ >> 1], sizeof bits);
    bits ^= (uint64_t)(operand_ & 1) << 63;
    memcpy(&value, &bits, sizeof value);
    return value;
}

static double other(const kmp_program *p, int i, const double *v)
{
    const kmp_instruction *in = &p->instruction[i];
    double x[3] = {0};
    for (int k = 0; k < kmp_op_arity((kmp_op)in->op); k++)
        x[k] = operand(v, kmp_instruction_operand(in, k));
    return kmp_program_value(p, i, x[0], x[1], x[2]);
}

const double *kmp_interpreter_run(kmp_interpreter *it, int stage)
{
    const kmp_program *p = it->p;
    const double *v = it->v;
    double *to = it->v + p->constant_count + p->input_count;
    for (int i = p->code[stage]; i < p->code[stage + 1]; i++) {
        const kmp_instruction *in = &p->instruction[i];
        switch (in->op) {
        case KMP_OP_ADD:
            to[i] = operand(v, in->a) + operand(v, in->b);
            break;
        case KMP_OP_MUL:
            to[i] = operand(v, in->a) * operand(v, in->b);
            break;
        case KMP_OP_DIV:
            to[i] = operand(v, in->a) / operand(v, in->b);
            break;
        case KMP_OP_SQRT:
            to[i] = sqrt(operand(v, in->a));
            break;
        case KMP_OP_TABLE:
            to[i] = kmp_table_value(p->table[in->b], (int)in->c, operand(v, in->a));
            break;
        default:
            to[i] = other(p, i, v);
        }
    }
    for (int k = p->outputs[stage]; k < p->outputs[stage + 1]; k++)
        it->out[k] = operand(v, p->output[k]);
    return it->out + p->outputs[stage];
}

const double *kmp_interpreter_outputs(const kmp_interpreter *it, int stage)
{
    return it->out + it->p->outputs[stage];
}

const double *kmp_interpreter_values(const kmp_interpreter *it)
{
    return it->v;
}
