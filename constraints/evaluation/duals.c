/* SPDX-License-Identifier: BSD-3-Clause */
/* Each value has its derivatives along KMP_DUALS_WIDTH inputs. Values that no current input changes are skipped. */
#include "constraints/evaluation/duals.h"
#include "base/clones.h"
#include "symbolic/ops.h"
#include "symbolic/table_function.h"
#include <math.h>
#include <string.h>

/* Derivatives of an operation's result with respect to the two operands that matter. */
typedef struct step {
    uint32_t from[2]; /* values; NOTHING: none */
    double by[2];
} step;

#define NOTHING UINT32_MAX

struct kmp_duals {
    const kmp_program *program;
    int inputs, first, count; /* values: constants, inputs from `inputs` on, operations from `first` on */
    double *value;
    step *steps;         /* an operation */
    int few_count, *few; /* the operations of all outputs but those set aside */
    bool *moves;         /* by value: it depends on the current inputs */
    double *slopes;      /* KMP_DUALS_WIDTH a value that moves */
    uint64_t *marks;     /* a value */
};

bool kmp_duals_know(const kmp_program *program)
{
    for (int i = 0; i < program->code[program->stages]; i++)
        if (program->instruction[i].op == KMP_OP_IMPLICIT || program->instruction[i].op == KMP_OP_LIST)
            return false;
    return true;
}

/* Lists the operations that outputs other than those set aside need. `needed`: of each value. */
static void list_few(kmp_duals *d, int aside, int aside_count, bool *needed)
{
    const kmp_program *p = d->program;
    for (int k = 0; k < p->outputs[p->stages]; k++)
        if (k < aside || k >= aside + aside_count)
            needed[p->output[k] >> 1] = true;
    for (int i = d->count - d->first - 1; i >= 0; i--) {
        const kmp_instruction *in = &p->instruction[i];
        for (int k = 0; needed[d->first + i] && k < kmp_op_arity((kmp_op)in->op); k++)
            needed[kmp_instruction_operand(in, k) >> 1] = true;
    }
    for (int i = 0; i < d->count - d->first; i++)
        if (needed[d->first + i])
            d->few[d->few_count++] = i;
}

kmp_duals *kmp_duals_new(const kmp_program *program, int aside, int aside_count, kmp_arena *arena)
{
    kmp_duals *d = KMP_ARENA_NEW(arena, kmp_duals, 1);
    if (!d)
        return NULL;
    int operations = program->code[program->stages];
    *d = (kmp_duals){.program = program, .inputs = program->constant_count};
    d->first = d->inputs + program->input_count;
    d->count = d->first + operations;
    if (!KMP_ARENA_MAKE(arena, KMP_ROOM(double, d->count, &d->value), KMP_ROOM(step, operations, &d->steps),
                        KMP_ROOM(int, operations, &d->few), KMP_ROOM(bool, d->count, &d->moves),
                        KMP_ROOM(double, (size_t)d->count *KMP_DUALS_WIDTH, &d->slopes),
                        KMP_ROOM(uint64_t, d->count, &d->marks)))
        return NULL;
    if (program->constant_count > 0)
        memcpy(d->value, program->constant, (size_t)program->constant_count * sizeof *d->value);
    memset(d->moves, 0, (size_t)d->count * sizeof *d->moves);
    list_few(d, aside, aside_count, d->moves);
    return d;
}

void kmp_duals_set(kmp_duals *duals, kmp_input_kind kind, const double *values)
{
    const kmp_program *p = duals->program;
    for (int k = 0; k < p->input_count; k++)
        if (p->input[k].kind == kind)
            duals->value[duals->inputs + k] = values[p->input[k].index];
}

/* -- values ------------------------------------------------------------------------------------------ */

static double of(const double *value, uint32_t operand)
{
    return operand & 1 ? -value[operand >> 1] : value[operand >> 1];
}

/* The derivative of a function of one variable x, whose value is f; functions of ops.def. */
static double slope_of(kmp_op op, double x, double f)
{
    switch (op) {
    case KMP_OP_SIN:
        return kmp_op_value(KMP_OP_COS, x, 0, 0);
    case KMP_OP_COS:
        return -kmp_op_value(KMP_OP_SIN, x, 0, 0);
    case KMP_OP_SQRT:
        return 0.5 / f;
    case KMP_OP_EXP:
        return f;
    case KMP_OP_LOG:
        return 1 / x;
    case KMP_OP_SINH:
        return cosh(x);
    case KMP_OP_COSH:
        return sinh(x);
    case KMP_OP_TANH:
        return 1 - f * f;
    case KMP_OP_ASIN:
        return 1 / sqrt(1 - x * x);
    case KMP_OP_ACOS:
        return -1 / sqrt(1 - x * x);
    case KMP_OP_ATAN:
        return 1 / (1 + x * x);
    case KMP_OP_ABS:
        return (x > 0) - (x < 0);
    default: /* SIGN, FLOOR: the jump has none */
        return 0;
    }
}

static double minus_of(uint32_t operand)
{
    return operand & 1 ? -1 : 1;
}

/* The step of a result that equals one operand. */
static step follow(uint32_t operand)
{
    return (step){{operand >> 1, NOTHING}, {minus_of(operand), 0}};
}

static step both(const kmp_instruction *in, double by_a, double by_b)
{
    return (step){{in->a >> 1, in->b >> 1}, {minus_of(in->a) * by_a, minus_of(in->b) * by_b}};
}

static step step_of(const kmp_program *p, const kmp_instruction *in, double x, double y, double f)
{
    switch ((kmp_op)in->op) {
    case KMP_OP_ADD:
        return both(in, 1, 1);
    case KMP_OP_MUL:
        return both(in, y, x);
    case KMP_OP_DIV:
        return both(in, 1 / y, -f / y);
    case KMP_OP_POW: /* no logarithm where the exponent is a number */
        return both(in, y * pow(x, y - 1), in->b >> 1 < (uint32_t)p->constant_count ? 0 : f * log(x));
    case KMP_OP_ATAN2:
        return both(in, y / (x * x + y * y), -x / (x * x + y * y));
    case KMP_OP_MIN:
        return follow(x < y ? in->a : in->b);
    case KMP_OP_MAX:
        return follow(y < x ? in->a : in->b);
    case KMP_OP_SELECT:
        return follow(x != 0 ? in->b : in->c);
    case KMP_OP_LESS:
        return (step){{NOTHING, NOTHING}, {0}};
    case KMP_OP_TABLE:
        return (step){{in->a >> 1, NOTHING},
                      {minus_of(in->a) * kmp_table_value(p->table[in->b], (int)in->c + 1, x), 0}};
    default:
        return (step){{in->a >> 1, NOTHING}, {minus_of(in->a) * slope_of((kmp_op)in->op, x, f), 0}};
    }
}

void kmp_duals_run(kmp_duals *duals)
{
    const kmp_program *p = duals->program;
    double *v = duals->value;
    for (int i = 0; i < p->code[p->stages]; i++) {
        const kmp_instruction *in = &p->instruction[i];
        int arity = kmp_op_arity((kmp_op)in->op);
        double x = of(v, in->a), y = arity > 1 ? of(v, in->b) : 0, z = arity > 2 ? of(v, in->c) : 0;
        double f = kmp_program_value(p, i, x, y, z);
        v[duals->first + i] = f;
        duals->steps[i] = step_of(p, in, x, y, f);
    }
}

double kmp_duals_value(const kmp_duals *duals, int k)
{
    return of(duals->value, duals->program->output[k]);
}

/* -- derivatives ------------------------------------------------------------------------------------- */

static KMP_INTO_CLONES void one(const double *restrict a, double by, double *restrict out)
{
    for (int j = 0; j < KMP_DUALS_WIDTH; j++)
        out[j] = by * a[j];
}

static KMP_INTO_CLONES void two(const double *restrict a, double by_a, const double *restrict b, double by_b,
                                double *restrict out)
{
    for (int j = 0; j < KMP_DUALS_WIDTH; j++)
        out[j] = by_a * a[j] + by_b * b[j];
}

/* The derivatives of operations, from the derivatives of the inputs: of those listed, or of all (NULL). */
static KMP_CLONES void pass_on(kmp_duals *duals, int count, const int *list)
{
    bool *moves = duals->moves;
    double *slopes = duals->slopes;
    for (int k = 0; k < count; k++) {
        const int i = list ? list[k] : k;
        const step *s = &duals->steps[i];
        bool a = s->from[0] != NOTHING && moves[s->from[0]], b = s->from[1] != NOTHING && moves[s->from[1]];
        double *out = slopes + (size_t)(duals->first + i) * KMP_DUALS_WIDTH;
        moves[duals->first + i] = a || b;
        if (a && b)
            two(slopes + (size_t)s->from[0] * KMP_DUALS_WIDTH, s->by[0], slopes + (size_t)s->from[1] * KMP_DUALS_WIDTH,
                s->by[1], out);
        else if (a || b)
            one(slopes + (size_t)s->from[b] * KMP_DUALS_WIDTH, s->by[b], out);
    }
}

void kmp_duals_along(kmp_duals *duals, kmp_input_kind kind, uint32_t first, bool few)
{
    /* The inputs that move, each with its own direction. */
    const kmp_program *p = duals->program;
    memset(duals->moves, 0, (size_t)duals->first * sizeof *duals->moves);
    for (int k = 0; k < p->input_count; k++) {
        uint32_t index = p->input[k].index;
        if (p->input[k].kind != kind || index < first || index >= first + KMP_DUALS_WIDTH)
            continue;
        double *slope = duals->slopes + (size_t)(duals->inputs + k) * KMP_DUALS_WIDTH;
        memset(slope, 0, KMP_DUALS_WIDTH * sizeof *slope);
        slope[index - first] = 1;
        duals->moves[duals->inputs + k] = true;
    }
    pass_on(duals, few ? duals->few_count : duals->count - duals->first, few ? duals->few : NULL);
}

bool kmp_duals_get(const kmp_duals *duals, int k, double slope[KMP_DUALS_WIDTH])
{
    uint32_t operand = duals->program->output[k], at = operand >> 1;
    if (!duals->moves[at])
        return false;
    one(duals->slopes + (size_t)at * KMP_DUALS_WIDTH, minus_of(operand), slope);
    return true;
}

/* -- dependences ------------------------------------------------------------------------------------- */

void kmp_duals_mark(kmp_duals *duals, kmp_input_kind kind, uint32_t first)
{
    const kmp_program *p = duals->program;
    memset(duals->marks, 0, (size_t)duals->first * sizeof *duals->marks);
    for (int k = 0; k < p->input_count; k++) {
        uint32_t index = p->input[k].index;
        if (p->input[k].kind == kind && index >= first && index < first + KMP_DUALS_MARKED)
            duals->marks[duals->inputs + k] = (uint64_t)1 << (index - first);
    }
    for (int i = 0; i < p->code[p->stages]; i++) {
        const kmp_instruction *in = &p->instruction[i];
        uint64_t mark = 0;
        for (int k = 0; k < kmp_op_arity((kmp_op)in->op); k++)
            mark |= duals->marks[kmp_instruction_operand(in, k) >> 1];
        duals->marks[duals->first + i] = mark;
    }
}

uint64_t kmp_duals_moves(const kmp_duals *duals, int k)
{
    return duals->marks[duals->program->output[k] >> 1];
}
