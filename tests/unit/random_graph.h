/* SPDX-License-Identifier: BSD-3-Clause */
/* Random expressions as a list of steps, which a plain loop of doubles can evaluate and a graph can be built from. */
#ifndef KEMPE_TESTS_RANDOM_GRAPH_H
#define KEMPE_TESTS_RANDOM_GRAPH_H

#include "random.h"
#include "symbolic/function_table.h"
#include "symbolic/graph.h"
#include "symbolic/ops.h"
#include "symbolic/trig.h"
#include <math.h>

enum { GRAPH_INPUTS = 5, GRAPH_STEPS = 60 };

typedef enum step_kind {
    STEP_CONST,
    STEP_INPUT,
    STEP_ADD,
    STEP_SUB,
    STEP_MUL,
    STEP_DIV,
    STEP_SIN,
    STEP_COS,
    STEP_SQRT,
    STEP_EXP,
    STEP_LOG,
    STEP_POWER,
    STEP_NEG,
    STEP_FUNCTION, /* any row of ops.def that is written as a function */
    STEP_ROTATE,   /* (a, b) by angle c: the first component; the next step is the second */
    STEP_SECOND,
    STEP_KINDS
} step_kind;

typedef struct step {
    step_kind kind;
    int a, b, c;
    kmp_op op;
    double value;
} step;

typedef struct steps {
    int count;
    step step[GRAPH_STEPS];
} steps;

static inline double step_value(const step *s, const double *x, const double *v)
{
    switch (s->kind) {
    case STEP_CONST:
        return s->value;
    case STEP_INPUT:
        return x[s->a];
    case STEP_ADD:
        return v[s->a] + v[s->b];
    case STEP_SUB:
        return v[s->a] - v[s->b];
    case STEP_MUL:
        return v[s->a] * v[s->b];
    case STEP_DIV:
        return v[s->a] / v[s->b];
    case STEP_SIN:
        return sin(v[s->a]);
    case STEP_COS:
        return cos(v[s->a]);
    case STEP_SQRT:
        return sqrt(v[s->a]);
    case STEP_EXP:
        return exp(v[s->a]);
    case STEP_LOG:
        return log(v[s->a]);
    case STEP_POWER:
        return pow(v[s->a], s->value);
    case STEP_NEG:
        return -v[s->a];
    case STEP_FUNCTION:
        return kmp_op_value(s->op, v[s->a], v[s->b], v[s->c]);
    case STEP_ROTATE:
        return v[s->a] * cos(v[s->c]) - v[s->b] * sin(v[s->c]);
    case STEP_SECOND:
        return v[s->a] * sin(v[s->c]) + v[s->b] * cos(v[s->c]);
    default:
        return NAN;
    }
}

/* Values of all steps. */
static inline void steps_eval(const steps *s, const double *x, double *v)
{
    for (int k = 0; k < s->count; k++)
        v[k] = step_value(&s->step[k], x, v);
}

static inline kmp_ref step_build(kmp_graph *g, const step *s, kmp_ref *r, int k)
{
    switch (s->kind) {
    case STEP_CONST:
        return kmp_const(g, s->value);
    case STEP_INPUT:
        return kmp_input(g, KMP_IN_Q, (uint32_t)s->a);
    case STEP_ADD:
        return kmp_add(g, r[s->a], r[s->b]);
    case STEP_SUB:
        return kmp_sub(g, r[s->a], r[s->b]);
    case STEP_MUL:
        return kmp_mul(g, r[s->a], r[s->b]);
    case STEP_DIV:
        return kmp_div(g, r[s->a], r[s->b]);
    case STEP_SIN:
        return kmp_sin(g, r[s->a]);
    case STEP_COS:
        return kmp_cos(g, r[s->a]);
    case STEP_SQRT:
        return kmp_sqrt(g, r[s->a]);
    case STEP_EXP:
        return kmp_unary(g, KMP_OP_EXP, r[s->a]);
    case STEP_LOG:
        return kmp_unary(g, KMP_OP_LOG, r[s->a]);
    case STEP_POWER:
        return kmp_power(g, r[s->a], s->value);
    case STEP_NEG:
        return kmp_neg(r[s->a]);
    case STEP_FUNCTION:
        return kmp_operate(g, s->op, (const kmp_ref[3]){r[s->a], r[s->b], r[s->c]});
    case STEP_ROTATE: {
        kmp_ref y = r[s->a];
        r[k + 1] = r[s->b];
        kmp_rotate(g, r[s->c], &y, &r[k + 1]);
        return y;
    }
    default:
        return r[k]; /* made with its first component */
    }
}

static inline void steps_build(const steps *s, kmp_graph *g, kmp_ref *r)
{
    for (int k = 0; k < s->count; k++)
        r[k] = step_build(g, &s->step[k], r, k);
}

/* True if the function is smooth around its operands. */
static inline bool function_is_tame(kmp_op op, double a, double b)
{
    switch (op) {
    case KMP_OP_SQRT:
    case KMP_OP_LOG:
    case KMP_OP_POW:
        return a > 0.5;
    case KMP_OP_ASIN:
    case KMP_OP_ACOS:
        return fabs(a) < 0.8;
    case KMP_OP_ATAN2:
        return a * a + b * b > 0.5 && (b > 0 || fabs(a) > 0.2);
    default:
        return true;
    }
}

/* True if the step is defined, and small, in a wide neighbourhood. */
static inline bool step_is_tame(const step *s, const double *x, const double *v)
{
    double a = v[s->a];
    switch (s->kind) {
    case STEP_DIV:
        return fabs(v[s->b]) > 0.5;
    case STEP_SQRT:
    case STEP_LOG:
    case STEP_POWER:
        if (a < 0.5)
            return false;
        break;
    case STEP_FUNCTION:
        if (!function_is_tame(s->op, a, v[s->b]))
            return false;
        break;
    default:
        break;
    }
    return fabs(step_value(s, x, v)) < 4;
}

static inline step random_step(int k)
{
    static const double exponents[] = {2, 3, 0.5, -1, -2, 1.5, 0.7, 5};
    step s = {.kind = (step_kind)pick(STEP_KINDS - 1), .a = pick(k), .b = pick(k), .c = pick(k)};
    if (s.kind == STEP_INPUT)
        s.a = pick(GRAPH_INPUTS);
    if (s.kind == STEP_CONST)
        s.value = pick(3) ? between(-2, 2) : pick(5) - 2;
    if (s.kind == STEP_POWER)
        s.value = exponents[pick(8)];
    while (s.kind == STEP_FUNCTION && (kmp_op_form_of(s.op) != KMP_FORM_FUNCTION || s.op == KMP_OP_LIST)) /* no value */
        s.op = (kmp_op)pick(KMP_OP_COUNT);
    return s;
}

/* Expressions that are tame at x. */
static inline void random_steps(steps *s, int count, const double *x)
{
    double v[GRAPH_STEPS];
    s->count = GRAPH_INPUTS;
    for (int k = 0; k < GRAPH_INPUTS; k++) {
        s->step[k] = (step){.kind = STEP_INPUT, .a = k};
        v[k] = x[k];
    }
    while (s->count < count) {
        int k = s->count;
        step new = random_step(k), second = new;
        if (!step_is_tame(&new, x, v) || (new.kind == STEP_ROTATE &&k + 1 == count))
            continue;
        v[k] = step_value(&new, x, v);
        s->step[s->count++] = new;
        if (new.kind != STEP_ROTATE)
            continue;
        second.kind = STEP_SECOND;
        v[k + 1] = step_value(&second, x, v);
        s->step[s->count++] = second;
    }
}

/* A reference's value among those of kmp_graph_eval. */
static inline double value_of(const double *value, kmp_ref r)
{
    return kmp_is_negative(r) ? -value[kmp_id(r)] : value[kmp_id(r)];
}

#endif
