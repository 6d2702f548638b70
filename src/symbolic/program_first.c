/* SPDX-License-Identifier: BSD-3-Clause */
#include "base/memory.h"
#include "symbolic/program.h"
#include <string.h>

/* The first stages of a program are taken over. Instructions of `given` (NULL: none) become inputs. */
typedef struct selection {
    const kmp_program *p;
    int stages;
    const bool *given; /* by instruction */
    int first;         /* of the inputs q that they become */
    int *list, count;  /* those that the others need */
} selection;

static int leaves(const kmp_program *p)
{
    return p->constant_count + p->input_count;
}

static void need(uint32_t *number, uint32_t operand)
{
    number[operand >> 1] = 1;
}

static uint32_t renumbered(const uint32_t *number, uint32_t operand)
{
    return (number[operand >> 1] - 1) << 1 | (operand & 1);
}

static kmp_instruction renumber(const kmp_instruction *in, const uint32_t *number)
{
    kmp_instruction out = *in;
    int arity = kmp_op_arity((kmp_op)in->op);
    out.a = renumbered(number, in->a);
    if (arity > 1)
        out.b = renumbered(number, in->b);
    if (arity > 2)
        out.c = renumbered(number, in->c);
    return out;
}

/* The table or block that an instruction applies; false: no memory. */
static bool take_applied(const kmp_program *p, kmp_instruction *in, int *block, kmp_program *to)
{
    int number = 0;
    if (in->op == KMP_OP_TABLE) {
        number = kmp_program_add_table(to, p->table[in->b]);
    } else if (in->op == KMP_OP_IMPLICIT) {
        if (block[in->b] == 0)
            block[in->b] = 1 + kmp_program_add_block(to, &p->block[in->b]);
        number = block[in->b] - 1;
    } else {
        return true;
    }
    in->b = (uint32_t)number;
    return number >= 0;
}

static bool take_code(const selection *s, uint32_t *number, uint32_t next, int *block, kmp_program *to)
{
    const kmp_program *p = s->p;
    int count = 0;
    for (int stage = 0; stage < to->stages; stage++) {
        to->code[stage] = count;
        for (int i = p->code[stage]; i < p->code[stage + 1]; i++) {
            if (!number[leaves(p) + i] || (s->given && s->given[i]))
                continue;
            kmp_instruction *in = &to->instruction[count++];
            *in = renumber(&p->instruction[i], number);
            number[leaves(p) + i] = ++next;
            if (!take_applied(p, in, block, to))
                return false;
        }
    }
    to->code[to->stages] = count;
    return true;
}

static bool fill(selection *s, uint32_t *number, int *block, kmp_program *to)
{
    const kmp_program *p = s->p;
    to->stages = s->stages;
    to->graph_nodes = p->graph_nodes;
    /* Marks the values that outputs of the stages need, backwards. */
    for (int k = 0; k < p->outputs[s->stages]; k++)
        need(number, p->output[k]);
    for (int i = p->code[s->stages]; i-- > 0;)
        for (int k = 0;
             number[leaves(p) + i] && !(s->given && s->given[i]) && k < kmp_op_arity((kmp_op)p->instruction[i].op); k++)
            need(number, kmp_instruction_operand(&p->instruction[i], k));
    /* Copies the constants and inputs in use; marks become numbers + 1. */
    uint32_t next = 0;
    for (int k = 0; k < p->constant_count; k++)
        if (number[k]) {
            to->constant[to->constant_count++] = p->constant[k];
            number[k] = ++next;
        }
    for (int k = 0; k < p->input_count; k++)
        if (number[p->constant_count + k]) {
            to->input[to->input_count++] = p->input[k];
            number[p->constant_count + k] = ++next;
        }
    for (int i = 0; s->given && i < p->code[s->stages]; i++)
        if (s->given[i] && number[leaves(p) + i]) {
            to->input[to->input_count++] = (kmp_program_input){KMP_IN_Q, (uint32_t)(s->first + s->count)};
            s->list[s->count++] = i;
            number[leaves(p) + i] = ++next;
        }
    if (!take_code(s, number, next, block, to))
        return false;
    memcpy(to->outputs, p->outputs, (size_t)(s->stages + 1) * sizeof *to->outputs);
    for (int k = 0; k < to->outputs[s->stages]; k++)
        to->output[k] = renumbered(number, p->output[k]);
    return true;
}

static kmp_program *take(selection *s)
{
    const kmp_program *p = s->p;
    const size_t code = (size_t)p->code[s->stages], inputs = (size_t)p->input_count + (s->given ? code : 0);
    kmp_program *to = kmp_program_with_room((size_t)s->stages, code, (size_t)p->outputs[s->stages],
                                            (size_t)p->constant_count, inputs);
    uint32_t *number = KMP_NEW(uint32_t, leaves(p) + p->code[p->stages]);
    int *block = KMP_NEW(int, p->block_count + 1);
    bool ok = to && number && block && fill(s, number, block, to);
    kmp_free(number);
    kmp_free(block);
    if (ok)
        return to;
    kmp_program_free(to);
    return NULL;
}

kmp_program *kmp_program_first(const kmp_program *p, int stages)
{
    selection s = {.p = p, .stages = stages};
    return take(&s);
}

kmp_program *kmp_program_given(const kmp_program *p, const bool *given, int first, int *list, int *count)
{
    selection s = {.p = p, .stages = p->stages, .given = given, .first = first, .list = list};
    kmp_program *to = take(&s);
    *count = s.count;
    return to;
}
