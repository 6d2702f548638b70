/* SPDX-License-Identifier: BSD-3-Clause */
/* A value is a row of doubles, one a candidate, filled up to a multiple of eight, so that the compiler makes vectors of
 * the loops. */
#include "symbolic/scan.h"
#include "base/clones.h"
#include "base/memory.h"
#include "symbolic/interpreter.h"
#include "symbolic/table.h"
#include <math.h>
#include <string.h>

/* Into each clone of run_stage. */
#if defined(__GNUC__)
#define ALWAYS inline __attribute__((always_inline))
#else
#define ALWAYS inline
#endif

enum { LANES = 8, FIRST = 1, LAST = 2 }; /* stages that depend on candidates */

/* What a value depends on: on nothing that changes, on the arguments alone, on both them and the candidate. */
typedef enum need { STANDING, COMMON, MOVING } need;

struct kmp_scan {
    const kmp_block *block;
    const double *candidate;
    int candidates;
    const kmp_program *p;
    kmp_interpreter *first; /* stage 0 */
    size_t width;           /* of a row */
    double *rows;           /* by value, then the merits */
    uint8_t *need;          /* by value */
    int *common;            /* those that the stages read */
    int common_count;
    size_t *every; /* first of each group of eight */
};

static int leaves(const kmp_program *p)
{
    return p->constant_count + p->input_count;
}

static double *row(const kmp_scan *s, uint32_t value)
{
    return s->rows + value * s->width;
}

/* -- running instructions ---------------------------------------------------------------------------- */

/* The groups of eight that are run. */
typedef struct groups {
    size_t count;
    const size_t *first;
} groups;

/* d = sign x op y on eight; a sign is a factor, which changes no bit else. Rows do not overlap. */
typedef struct pair {
    const double *restrict x, *restrict y;
    double sign_x, sign_y;
} pair;

/* The lanes of one group. */
#define EACH(l) for (size_t l = 0; l < LANES; l++)

static ALWAYS void add_eight(const pair *o, size_t from, double *restrict d)
{
    const double *restrict x = o->x + from, *restrict y = o->y + from;
    if (o->sign_x > 0 && o->sign_y > 0)
        EACH(l)
    d[l] = x[l] + y[l];
    else if (o->sign_x > 0) EACH(l) d[l] = x[l] - y[l];
    else if (o->sign_y > 0) EACH(l) d[l] = y[l] - x[l];
    else EACH(l) d[l] = -x[l] - y[l];
}

static ALWAYS void add(const pair *o, const groups *n, double *restrict d)
{
    for (size_t j = 0; j < n->count; j++)
        add_eight(o, n->first[j], d + n->first[j]);
}

static ALWAYS void multiply(const pair *o, const groups *n, double *restrict d)
{
    double sign = o->sign_x * o->sign_y;
    for (size_t j = 0; j < n->count; j++) {
        const double *restrict x = o->x + n->first[j], *restrict y = o->y + n->first[j];
        double *restrict to = d + n->first[j];
        EACH(l)
        to[l] = sign * x[l] * y[l];
    }
}

static ALWAYS void divide(const pair *o, const groups *n, double *restrict d)
{
    double sign = o->sign_x * o->sign_y;
    for (size_t j = 0; j < n->count; j++) {
        const double *restrict x = o->x + n->first[j], *restrict y = o->y + n->first[j];
        double *restrict to = d + n->first[j];
        EACH(l)
        to[l] = sign * x[l] / y[l];
    }
}

static ALWAYS void root(const pair *o, const groups *n, double *restrict d)
{
    for (size_t j = 0; j < n->count; j++) {
        const double *restrict x = o->x + n->first[j];
        double *restrict to = d + n->first[j];
        EACH(l)
        to[l] = sqrt(o->sign_x * x[l]);
    }
}

static ALWAYS void larger(const pair *o, const groups *n, double *restrict d)
{
    for (size_t j = 0; j < n->count; j++) {
        const double *restrict at = o->x + n->first[j], *restrict beside = o->y + n->first[j];
        double *restrict to = d + n->first[j];
        EACH(l)
        {
            double x = o->sign_x * at[l], y = o->sign_y * beside[l];
            to[l] = x > y || isnan(x) ? x : y;
        }
    }
}

static void other_at(const kmp_scan *s, int i, size_t from, double *d)
{
    const kmp_instruction *in = &s->p->instruction[i];
    for (size_t l = from; l < from + LANES; l++) {
        double x[3] = {0};
        for (int k = 0; k < kmp_op_arity((kmp_op)in->op); k++) {
            uint32_t operand = kmp_instruction_operand(in, k);
            x[k] = row(s, operand >> 1)[l];
            x[k] = operand & 1 ? -x[k] : x[k];
        }
        d[l] = kmp_program_value(s->p, i, x[0], x[1], x[2]);
    }
}

static double sign_of(uint32_t operand)
{
    return operand & 1 ? -1 : 1;
}

static void other(const kmp_scan *s, int i, const groups *n, double *d)
{
    for (size_t j = 0; j < n->count; j++)
        other_at(s, i, n->first[j], d);
}

static void look_up(const kmp_scan *s, const kmp_instruction *in, const pair *o, const groups *n, double *d)
{
    for (size_t j = 0; j < n->count; j++)
        kmp_table_values(s->p->table[in->b], (int)in->c, LANES, o->sign_x, o->x + n->first[j], d + n->first[j]);
}

static ALWAYS void run_instruction(const kmp_scan *s, int i, const groups *n)
{
    const kmp_instruction *in = &s->p->instruction[i];
    double *d = row(s, (uint32_t)(leaves(s->p) + i));
    bool two = in->op == KMP_OP_ADD || in->op == KMP_OP_MUL || in->op == KMP_OP_DIV || in->op == KMP_OP_MAX;
    const pair o = {.x = row(s, in->a >> 1),
                    .sign_x = sign_of(in->a),
                    .y = two ? row(s, in->b >> 1) : NULL,
                    .sign_y = two ? sign_of(in->b) : 1};
    if (in->op == KMP_OP_ADD)
        add(&o, n, d);
    else if (in->op == KMP_OP_MUL)
        multiply(&o, n, d);
    else if (in->op == KMP_OP_DIV)
        divide(&o, n, d);
    else if (in->op == KMP_OP_MAX)
        larger(&o, n, d);
    else if (in->op == KMP_OP_SQRT)
        root(&o, n, d);
    else if (in->op == KMP_OP_TABLE)
        look_up(s, in, &o, n, d);
    else
        other(s, i, n, d);
}

KMP_CLONES static void run_stage(const kmp_scan *s, int stage, need what, const groups *n)
{
    for (int i = s->p->code[stage]; i < s->p->code[stage + 1]; i++)
        if (s->need[leaves(s->p) + i] == what)
            run_instruction(s, i, n);
}

/* -- making one -------------------------------------------------------------------------------------- */

static need need_of_input(const kmp_program_input *input)
{
    return input->kind == KMP_IN_PARAMETER ? COMMON : input->index == 0 ? STANDING : MOVING;
}

/* Two of which one is common and one standing make a moving one. */
static need join(need a, need b)
{
    return a == b ? a : MOVING;
}

static bool is_number(const kmp_program *p, uint32_t operand)
{
    return (int)(operand >> 1) < p->constant_count;
}

/* Numbers go with either. What is common has been left to stage 0, but for programs from files. */
static need need_of_instruction(const kmp_scan *s, int i)
{
    const kmp_instruction *in = &s->p->instruction[i];
    need n = STANDING;
    bool first = true;
    for (int k = 0; k < kmp_op_arity((kmp_op)in->op); k++) {
        uint32_t operand = kmp_instruction_operand(in, k);
        if (is_number(s->p, operand))
            continue;
        n = first ? (need)s->need[operand >> 1] : join(n, (need)s->need[operand >> 1]);
        first = false;
    }
    return n == COMMON ? MOVING : n;
}

static void find_needs(kmp_scan *s)
{
    const kmp_program *p = s->p;
    for (int k = 0; k < p->constant_count; k++)
        s->need[k] = STANDING;
    for (int k = 0; k < p->input_count; k++)
        s->need[p->constant_count + k] = (uint8_t)need_of_input(&p->input[k]);
    for (int i = 0; i < p->code[LAST + 1]; i++)
        s->need[leaves(p) + i] = (uint8_t)(i < p->code[FIRST] ? COMMON : need_of_instruction(s, i));
}

static void find_common(kmp_scan *s)
{
    const kmp_program *p = s->p;
    uint8_t *seen = s->need + leaves(p) + p->code[LAST + 1]; /* as many as values */
    for (int i = p->code[FIRST]; i < p->code[LAST + 1]; i++)
        for (int k = 0; s->need[leaves(p) + i] != COMMON && k < kmp_op_arity((kmp_op)p->instruction[i].op); k++)
            seen[kmp_instruction_operand(&p->instruction[i], k) >> 1] = 1;
    for (int k = p->outputs[FIRST]; k < p->outputs[LAST + 1]; k++)
        seen[p->output[k] >> 1] = 1;
    for (int value = 0; value < leaves(p) + p->code[LAST + 1]; value++)
        if (seen[value] && s->need[value] == COMMON)
            s->common[s->common_count++] = value;
}

static void fill(double *to, size_t width, double value)
{
    for (size_t l = 0; l < width; l++)
        to[l] = value;
}

static void put_standing(kmp_scan *s)
{
    const kmp_program *p = s->p;
    const groups all = {s->width / LANES, s->every};
    for (int k = 0; k < p->constant_count; k++)
        fill(row(s, (uint32_t)k), s->width, p->constant[k]);
    for (int k = 0; k < p->input_count; k++)
        if (s->need[p->constant_count + k] == STANDING) {
            double *to = row(s, (uint32_t)(p->constant_count + k));
            fill(to, s->width, s->candidate[0]);
            memcpy(to, s->candidate, (size_t)s->candidates * sizeof *to);
        }
    for (int stage = FIRST; stage <= LAST; stage++)
        run_stage(s, stage, STANDING, &all);
}

kmp_scan *kmp_scan_new(const kmp_block *block, int candidates, const double *candidate)
{
    kmp_scan *s = KMP_NEW(kmp_scan, 1);
    if (!s)
        return NULL;
    s->block = block;
    s->candidates = candidates;
    s->candidate = candidate;
    s->p = block->program;
    size_t values = (size_t)leaves(s->p) + (size_t)s->p->code[LAST + 1];
    s->width = ((size_t)candidates + LANES - 1) / LANES * LANES;
    s->rows = kmp_calloc((values + 1) * s->width, sizeof *s->rows);
    s->need = kmp_calloc(2 * values, sizeof *s->need);
    s->common = kmp_calloc(values, sizeof *s->common);
    s->first = kmp_interpreter_new(s->p);
    s->every = kmp_calloc(s->width / LANES, sizeof *s->every);
    if (!s->rows || !s->need || !s->common || !s->first || !s->every) {
        kmp_scan_free(s);
        return NULL;
    }
    for (size_t k = 0; k < s->width / LANES; k++)
        s->every[k] = k * LANES;
    find_needs(s);
    find_common(s);
    put_standing(s);
    return s;
}

void kmp_scan_free(kmp_scan *s)
{
    if (!s)
        return;
    kmp_interpreter_free(s->first);
    kmp_free(s->rows);
    kmp_free(s->need);
    kmp_free(s->common);
    kmp_free(s->every);
    kmp_free(s);
}

/* -- running it -------------------------------------------------------------------------------------- */

/* The other unknowns are what was guessed. */
static void put_guesses(kmp_scan *s)
{
    const kmp_program *p = s->p;
    for (int k = 0; k < p->input_count; k++) {
        if (p->input[k].kind != KMP_IN_Q || p->input[k].index == 0)
            continue;
        uint32_t from = p->output[p->outputs[FIRST] + (int)p->input[k].index];
        double *to = row(s, (uint32_t)(p->constant_count + k)), sign = sign_of(from);
        for (size_t l = 0; l < s->width; l++)
            to[l] = sign * row(s, from >> 1)[l];
    }
}

void kmp_scan_set(kmp_scan *s, const double *arguments)
{
    kmp_interpreter_set(s->first, KMP_IN_PARAMETER, arguments);
    (void)kmp_interpreter_run(s->first, 0);
}

static void put_common(const kmp_scan *s, const groups *n)
{
    const double *values = kmp_interpreter_values(s->first);
    for (int k = 0; k < s->common_count; k++) {
        double *to = row(s, (uint32_t)s->common[k]), value = values[s->common[k]];
        for (size_t j = 0; j < n->count; j++)
            for (size_t l = n->first[j]; l < n->first[j] + LANES; l++)
                to[l] = value;
    }
}

void kmp_scan_groups(kmp_scan *s, int stage, size_t count, const size_t *first)
{
    const groups n = {count, first};
    if (stage == FIRST)
        put_common(s, &n);
    run_stage(s, stage, MOVING, &n);
}

void kmp_scan_every(kmp_scan *s, int stage)
{
    kmp_scan_groups(s, stage, s->width / LANES, s->every);
}

const double *kmp_scan_output(const kmp_scan *s, int stage, int k, double *sign)
{
    uint32_t output = s->p->output[s->p->outputs[stage] + k];
    *sign = sign_of(output);
    return row(s, output >> 1);
}

const double *kmp_scan_run(kmp_scan *s, const double *arguments)
{
    double sign, *to = row(s, (uint32_t)(leaves(s->p) + s->p->code[LAST + 1]));
    kmp_scan_set(s, arguments);
    kmp_scan_every(s, FIRST);
    put_guesses(s);
    kmp_scan_every(s, LAST);
    const double *merit = kmp_scan_output(s, LAST, 0, &sign);
    for (size_t l = 0; l < s->width; l++)
        to[l] = sign * merit[l];
    return to;
}
