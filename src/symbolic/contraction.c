/* SPDX-License-Identifier: BSD-3-Clause */
/* A product with a single reader becomes part of it, if that is a sum of its stage; of two such products the second
 * one. A sum takes none where it lies on the longest path through its stage and waits for the other operand: a
 * single addition is faster. */
#include "symbolic/contraction.h"

/* Durations in cycles, as on processors of Intel and AMD since 2017 (A. Fog, Instruction tables, 2022): an addition
 * takes 2 to 4, a product 3 or 4, a division 8 to 15, sines about 30. Only their order of size matters here. */
enum { SUM = 3, PRODUCT = 4, QUOTIENT = 13, OTHER = 30 };

/* By instruction: readers; cycles until its value is known, and from there to the end of the stage; its stage. */
typedef struct choice {
    const kmp_program *program;
    int leaves;
    uint32_t *readers, *known, *rest;
    bool *exact; /* by instruction: it is computed separately */
    uint8_t *result;
} choice;

/* The instruction behind an operand, -1 for a leaf. */
static int behind(const choice *c, uint32_t operand)
{
    int i = (int)(operand >> 1) - c->leaves;
    return i >= 0 ? i : -1;
}

static uint32_t duration(const kmp_instruction *in)
{
    switch (in->op) {
    case KMP_OP_ADD:
        return SUM;
    case KMP_OP_MUL:
        return PRODUCT;
    case KMP_OP_DIV:
        return QUOTIENT;
    default:
        return OTHER;
    }
}

static uint32_t largest(uint32_t a, uint32_t b)
{
    return a > b ? a : b;
}

/* Returns the duration of the stage of instructions `first` to `end`. Values that earlier stages compute are known. */
static uint32_t find_paths(choice *c, int first, int end)
{
    const kmp_instruction *all = c->program->instruction;
    uint32_t most = 0;
    for (int i = first; i < end; i++) {
        for (int k = 0; k < kmp_op_arity((kmp_op)all[i].op); k++) {
            int read = behind(c, kmp_instruction_operand(&all[i], k));
            c->known[i] = largest(c->known[i], read >= first ? c->known[read] : 0);
        }
        c->known[i] += duration(&all[i]);
        most = largest(most, c->known[i]);
    }
    for (int i = end; i-- > first;)
        for (int k = 0; k < kmp_op_arity((kmp_op)all[i].op); k++) {
            int read = behind(c, kmp_instruction_operand(&all[i], k));
            if (read >= first)
                c->rest[read] = largest(c->rest[read], c->rest[i] + duration(&all[i]));
        }
    return most;
}

/* The product behind the operand of a sum of a stage that begins with `first`, if the sum can take it; otherwise -1. */
static int product_of(const choice *c, int first, uint32_t operand)
{
    int k = behind(c, operand);
    return k >= first && c->program->instruction[k].op == KMP_OP_MUL && c->readers[k] == 1 ? k : -1;
}

static void choose(choice *c, int first, uint32_t longest, int sum)
{
    const kmp_instruction *in = &c->program->instruction[sum];
    int a = product_of(c, first, in->a), b = product_of(c, first, in->b), product = b >= 0 ? b : a;
    int other = behind(c, b >= 0 ? in->a : in->b);
    if (product < 0)
        return;
    bool waits = other >= first && c->known[other] >= c->known[product];
    if (waits && c->known[sum] + c->rest[sum] == longest)
        return;
    c->result[sum] = b >= 0 ? KMP_WITH_SECOND : KMP_WITH_FIRST;
    c->result[product] = KMP_CONTRACTED;
}

uint8_t *kmp_program_contraction(const kmp_program *program, int first, int end, kmp_arena *arena)
{
    int count = program->code[program->stages];
    choice c = {.program = program, .leaves = program->constant_count + program->input_count};
    c.result = KMP_ARENA_NEW(arena, uint8_t, count);
    c.exact = KMP_ARENA_NEW(arena, bool, count);
    if (!KMP_ARENA_EACH(arena, uint32_t, count, &c.readers, &c.known, &c.rest))
        return NULL;
    /* Readers of each instruction. */
    const kmp_program *p = c.program;
    for (int i = 0; i < p->code[p->stages]; i++) {
        const kmp_instruction *in = &p->instruction[i];
        for (int k = 0; k < kmp_op_arity((kmp_op)in->op); k++)
            if (behind(&c, kmp_instruction_operand(in, k)) >= 0)
                c.readers[behind(&c, kmp_instruction_operand(in, k))]++;
    }
    for (int k = 0; k < p->outputs[p->stages]; k++)
        if (behind(&c, p->output[k]) >= 0)
            c.readers[behind(&c, p->output[k])]++;
    /* Marks what outputs need. */
    for (int k = first; k < end; k++)
        if (behind(&c, p->output[k]) >= 0)
            c.exact[behind(&c, p->output[k])] = true;
    for (int i = p->code[p->stages]; i-- > 0;)
        for (int k = 0; c.exact[i] && k < kmp_op_arity((kmp_op)p->instruction[i].op); k++) {
            int read = behind(&c, kmp_instruction_operand(&p->instruction[i], k));
            if (read >= 0)
                c.exact[read] = true;
        }
    for (int s = 0; s < program->stages; s++) {
        uint32_t longest = find_paths(&c, program->code[s], program->code[s + 1]);
        for (int i = program->code[s]; i < program->code[s + 1]; i++)
            if (program->instruction[i].op == KMP_OP_ADD && !c.exact[i])
                choose(&c, program->code[s], longest, i);
    }
    return c.result;
}

bool kmp_program_contract(kmp_program *program, int first, int end)
{
    program->contraction = kmp_program_contraction(program, first, end, &program->arena);
    return program->contraction;
}

kmp_multiply_add kmp_multiply_add_of(const kmp_program *program, int sum, kmp_contraction with)
{
    const kmp_instruction *in = &program->instruction[sum];
    uint32_t product = with == KMP_WITH_FIRST ? in->a : in->b, rest = with == KMP_WITH_FIRST ? in->b : in->a;
    uint32_t i = (product >> 1) - (uint32_t)(program->constant_count + program->input_count);
    const kmp_instruction *factors = &program->instruction[i];
    return (kmp_multiply_add){i, factors->a ^ (product & 1), factors->b, rest};
}
