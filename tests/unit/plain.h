/* SPDX-License-Identifier: BSD-3-Clause */
/* Programs evaluated instruction by instruction: with a rounding for each operation, except for products that the
 * program contracts with a sum. */
#pragma once

#include "base/memory.h"
#include "symbolic/contraction.h"
#include <math.h>
#include <string.h>

typedef struct plain {
    const kmp_program *p;
    double *v;
    double *out;
    kmp_arena arena;
} plain;

static inline plain plain_new(const kmp_program *p)
{
    plain a = {.p = p};
    a.v = KMP_ARENA_NEW(&a.arena, double, p->constant_count + p->input_count + p->code[p->stages]);
    a.out = KMP_ARENA_NEW(&a.arena, double, p->outputs[p->stages]);
    memcpy(a.v, p->constant, (size_t)p->constant_count * sizeof(double));
    return a;
}

static inline void plain_free(plain *a)
{
    kmp_arena_free(&a->arena);
}

static inline double plain_operand(const plain *a, uint32_t operand)
{
    double v = a->v[operand >> 1];
    return operand & 1 ? -v : v;
}

/* A product that is part of a sum is computed, too, and read by nothing else. */
static inline double plain_instruction(const plain *a, int i)
{
    double x[3] = {0};
    const kmp_instruction *in = &a->p->instruction[i];
    kmp_contraction with = a->p->contraction ? (kmp_contraction)a->p->contraction[i] : KMP_ALONE;
    if (with == KMP_WITH_FIRST || with == KMP_WITH_SECOND) {
        kmp_multiply_add m = kmp_multiply_add_of(a->p, i, with);
        return fma(plain_operand(a, m.x), plain_operand(a, m.y), plain_operand(a, m.z));
    }
    for (int k = 0; k < kmp_op_arity((kmp_op)in->op); k++)
        x[k] = plain_operand(a, kmp_instruction_operand(in, k));
    return kmp_program_value(a->p, i, x[0], x[1], x[2]);
}

/* The outputs of a stage. */
static inline const double *plain_run(plain *a, const double *const inputs[KMP_IN_COUNT], int stage)
{
    const kmp_program *p = a->p;
    int leaves = p->constant_count + p->input_count;
    for (int k = 0; k < p->input_count; k++)
        a->v[p->constant_count + k] = inputs[p->input[k].kind] ? inputs[p->input[k].kind][p->input[k].index] : NAN;
    for (int i = p->code[stage]; i < p->code[stage + 1]; i++)
        a->v[leaves + i] = plain_instruction(a, i);
    for (int k = p->outputs[stage]; k < p->outputs[stage + 1]; k++)
        a->out[k] = plain_operand(a, p->output[k]);
    return a->out + p->outputs[stage];
}
