/* SPDX-License-Identifier: BSD-3-Clause */
#include "base/memory.h"
#include "symbolic/program/program.h"
#include "symbolic/table_function.h"

static kmp_ref operand(const kmp_ref *value, uint32_t operand)
{
    return operand & 1 ? kmp_neg(value[operand >> 1]) : value[operand >> 1];
}

static kmp_ref import(const kmp_program *p, kmp_graph *g, const kmp_instruction *in, const kmp_ref *value)
{
    kmp_ref x[3] = {0};
    for (int k = 0; k < kmp_op_arity((kmp_op)in->op); k++)
        x[k] = operand(value, kmp_instruction_operand(in, k));
    if (in->op != KMP_OP_TABLE)
        return kmp_operate(g, (kmp_op)in->op, x);
    int table = kmp_graph_add_table(g, p->table[in->b]);
    return table < 0 ? KMP_ZERO : kmp_table_derivative_at(g, table, (int)in->c, x[0]);
}

/* The inputs, or their replacements. */
static bool import_inputs(const kmp_program *p, kmp_graph *g, int count, const kmp_ref *input, const kmp_ref *by,
                          kmp_ref *value)
{
    uint32_t nodes = kmp_graph_count(g);
    int *which = KMP_NEW(int, nodes); /* + 1, by node */
    for (int k = 0; which && k < count; k++)
        which[kmp_id(input[k])] = k + 1;
    for (int k = 0; which && k < p->input_count; k++) {
        kmp_ref x = kmp_input(g, p->input[k].kind, p->input[k].index);
        int replaced = kmp_id(x) < nodes ? which[kmp_id(x)] : 0;
        value[k] = replaced ? by[replaced - 1] : x;
    }
    bool made = which;
    kmp_free(which);
    return made;
}

bool kmp_program_import(const kmp_program *p, kmp_graph *g, int count, const kmp_ref *input, const kmp_ref *by,
                        kmp_ref *outputs)
{
    int leaves = p->constant_count + p->input_count, code = p->code[p->stages];
    if (p->block_count > 0)
        return false;
    kmp_ref *value = KMP_NEW(kmp_ref, leaves + code);
    if (!value || !import_inputs(p, g, count, input, by, value + p->constant_count)) {
        kmp_free(value);
        return false;
    }
    for (int k = 0; k < p->constant_count; k++)
        value[k] = kmp_const(g, p->constant[k]);
    for (int i = 0; i < code; i++)
        value[leaves + i] = import(p, g, &p->instruction[i], value);
    for (int k = 0; k < p->outputs[p->stages]; k++)
        outputs[k] = operand(value, p->output[k]);
    kmp_free(value);
    return !kmp_graph_failed(g);
}
