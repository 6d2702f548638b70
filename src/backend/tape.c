/* SPDX-License-Identifier: BSD-3-Clause */
/* The branch-free tape: every add, subtract and multiply is v[d] = v[a] * v[b] + v[c] with two roundings, so that there
 * is no opcode to mispredict:
 *
 *     x + y = x * 1 + y      x - y = y * (-1) + x      x * y = x * y + (-0)      x + p * q = p * q + x
 *
 * all equal to the last bit. A stage is a row of segments: records, then the sincos of all angles that are known by
 * then in lanes, then what else is no record (division, functions). Slots are 16 bits wide when they suffice, 32
 * otherwise. */
#include "backend/tape.h"
#include "backend/sincos.h"
#include <string.h>

static void set(void *code, kmp_input_kind kind, const double *values)
{
    tape *t = code;
    for (int k = t->feed_start[kind]; k < t->feed_start[kind + 1]; k++)
        t->v[t->feeds[k].slot] = values[t->feeds[k].index];
}

static void run_narrow(const record16 *r, const record16 *end, double *v)
{
    for (; r < end; r++)
        v[r->d] = v[r->a] * v[r->b] + v[r->c];
}

static void run_wide(const record32 *r, const record32 *end, double *v)
{
    for (; r < end; r++)
        v[r->d] = v[r->a] * v[r->b] + v[r->c];
}

static void run_angles(tape *t, uint32_t first, uint32_t end)
{
    int n = (int)(end - first);
    double *x = t->lane, *s = x + n, *c = s + n;
    for (int k = 0; k < n; k++)
        x[k] = t->v[t->angle[first + (uint32_t)k]];
    kmp_sincos_many(n, x, s, c);
    for (int k = 0; k < n; k++) {
        t->v[t->sine[first + (uint32_t)k]] = s[k];
        t->v[t->cosine[first + (uint32_t)k]] = c[k];
    }
}

static double run_implicit(const tape *t, const special *s)
{
    const kmp_instruction *in = &t->program->instruction[s->instruction];
    kmp_solving *solving = t->solving[in->b];
    double *p = kmp_solving_arguments(solving);
    for (int l = 0; l < t->program->block[in->b].arguments; l++) {
        const argument *a = &t->arguments[s->operand[0] + (uint32_t)l];
        p[l] = t->v[a->slot] * a->factor;
    }
    return kmp_solving_value(solving, (int)in->c);
}

/* Operands that an operation has not are the slot of 1. */
static void run_special(const tape *t, const special *s, double *v)
{
    double x[3];
    if (s->op == KMP_OP_DIV) { /* carries no signs */
        v[s->d] = v[s->operand[0]] / v[s->operand[1]];
        return;
    }
    if (s->op == KMP_OP_IMPLICIT) {
        v[s->d] = run_implicit(t, s);
        return;
    }
    for (int k = 0; k < 3; k++)
        x[k] = s->minus[k] ? -v[s->operand[k]] : v[s->operand[k]];
    v[s->d] = kmp_program_value(t->program, (int)s->instruction, x[0], x[1], x[2]);
}

static void run(void *code, int stage)
{
    tape *t = code;
    for (uint32_t k = t->stage[stage]; k < t->stage[stage + 1]; k++) {
        const segment *here = &t->segments[k], *next = here + 1;
        if (t->narrow)
            run_narrow(t->narrow + here->record, t->narrow + next->record, t->v);
        else
            run_wide(t->wide + here->record, t->wide + next->record, t->v);
        if (next->angle > here->angle)
            run_angles(t, here->angle, next->angle);
        for (uint32_t i = here->special; i < next->special; i++)
            run_special(t, &t->specials[i], t->v);
    }
    for (uint32_t k = t->copy_start[stage]; k < t->copy_start[stage + 1]; k++)
        t->v[t->copies[k].to] = t->v[t->copies[k].from] * t->copies[k].factor;
}

static const double *outputs(const void *code, int stage)
{
    const tape *t = code;
    return t->out + t->program->outputs[stage];
}

const kmp_backend kmp_backend_tape = {"tape", kmp_tape_prepare, kmp_tape_release, set, run, outputs};
