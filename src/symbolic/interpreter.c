/* SPDX-License-Identifier: BSD-3-Clause */
#include "symbolic/interpreter.h"
#include "base/memory.h"
#include <string.h>

struct kmp_interpreter {
    const kmp_program *p;
    double *v; /* constants, inputs, instructions */
    double *out;
};

kmp_interpreter *kmp_interpreter_new(const kmp_program *p)
{
    kmp_interpreter *it = KMP_NEW(kmp_interpreter, 1);
    if (!it)
        return NULL;
    it->p = p;
    it->v = KMP_NEW(double, p->constant_count + p->input_count + p->code[p->stages]);
    it->out = KMP_NEW(double, p->outputs[p->stages]);
    if (!it->v || !it->out) {
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
    kmp_free(it->v);
    kmp_free(it->out);
    kmp_free(it);
}

void kmp_interpreter_set(kmp_interpreter *it, kmp_input_kind kind, const double *values)
{
    const kmp_program *p = it->p;
    for (int k = 0; k < p->input_count; k++)
        if (p->input[k].kind == kind)
            it->v[p->constant_count + k] = values[p->input[k].index];
}

static double operand(const kmp_interpreter *it, uint32_t operand_)
{
    double v = it->v[operand_ >> 1];
    return operand_ & 1 ? -v : v;
}

const double *kmp_interpreter_run(kmp_interpreter *it, int stage)
{
    const kmp_program *p = it->p;
    double *v = it->v + p->constant_count + p->input_count;
    for (int i = p->code[stage]; i < p->code[stage + 1]; i++) {
        double x[3] = {0};
        for (int k = 0; k < kmp_op_arity((kmp_op)p->instruction[i].op); k++)
            x[k] = operand(it, kmp_instruction_operand(&p->instruction[i], k));
        v[i] = kmp_program_value(p, i, x[0], x[1], x[2]);
    }
    for (int k = p->outputs[stage]; k < p->outputs[stage + 1]; k++)
        it->out[k] = operand(it, p->output[k]);
    return it->out + p->outputs[stage];
}
