/* SPDX-License-Identifier: BSD-3-Clause */
#include "base/memory.h"
#include "symbolic/implicit.h"
#include "symbolic/program.h"
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
    if (in->op == KMP_OP_IMPLICIT)
        return kmp_implicit_component(g, kmp_graph_add_block(g, &p->block[in->b]), (int)in->c, x[0]);
    if (in->op != KMP_OP_TABLE)
        return kmp_operate(g, (kmp_op)in->op, x);
    int table = kmp_graph_add_table(g, p->table[in->b]);
    return table < 0 ? KMP_ZERO : kmp_table_derivative_at(g, table, (int)in->c, x[0]);
}

/* Constants, and inputs or their replacements. */
static bool import_leaves(const kmp_program *p, kmp_graph *g, int count, const kmp_ref *input, const kmp_ref *by,
                          kmp_ref *value)
{
    uint32_t nodes = kmp_graph_count(g);
    int *which = KMP_NEW(int, nodes); /* + 1, by node */
    for (int k = 0; which && k < count; k++)
        which[kmp_id(input[k])] = k + 1;
    for (int k = 0; which && k < p->input_count; k++) {
        kmp_ref x = kmp_input(g, p->input[k].kind, p->input[k].index);
        int replaced = kmp_id(x) < nodes ? which[kmp_id(x)] : 0;
        value[p->constant_count + k] = replaced ? by[replaced - 1] : x;
    }
    for (int k = 0; which && k < p->constant_count; k++)
        value[k] = kmp_const(g, p->constant[k]);
    bool made = which;
    kmp_free(which);
    return made;
}

/* -- two places near each other ------------------------------------------------------------------------ */

/* Instructions whose values at the first place are needed: operands of sines and cosines, and what these need. */
static void mark_needed(const kmp_program *p, bool *needed)
{
    int leaves = p->constant_count + p->input_count;
    for (int i = p->code[p->stages]; i-- > 0;) {
        const kmp_instruction *in = &p->instruction[i];
        bool turns = in->op == KMP_OP_SIN || in->op == KMP_OP_COS;
        for (int k = 0; (turns || needed[i]) && k < kmp_op_arity((kmp_op)in->op); k++) {
            int from = (int)(kmp_instruction_operand(in, k) >> 1) - leaves;
            if (from >= 0)
                needed[from] = true;
        }
    }
}

/* sin d and cos d - 1 of a small angle, by their series. */
static void small_angle(kmp_graph *g, kmp_ref d, kmp_ref *sine, kmp_ref *versine)
{
    kmp_ref square = kmp_mul(g, d, d);
    *sine = kmp_mul(g, d, kmp_sub(g, KMP_ONE, kmp_mul(g, square, kmp_const(g, 1.0 / 6))));
    *versine = kmp_mul(g, square, kmp_sub(g, kmp_mul(g, square, kmp_const(g, 1.0 / 24)), kmp_const(g, 0.5)));
}

static void note_turn(kmp_angle_updates *turns, kmp_ref d)
{
    for (int k = 0; k < turns->count; k++)
        if (kmp_id(turns->angle[k]) == kmp_id(d))
            return;
    turns->angle[turns->count++] = d;
}

/* Sine or cosine of b = a + d, of those of a, as it is plus a small part. */
static kmp_ref turn(kmp_graph *g, kmp_op op, kmp_ref a, kmp_ref b, kmp_angle_updates *turns)
{
    kmp_ref d = kmp_sub(g, b, a), sine, versine, s = kmp_sin(g, a), c = kmp_cos(g, a);
    if (d == KMP_ZERO)
        return kmp_unary(g, op, a);
    note_turn(turns, d);
    small_angle(g, d, &sine, &versine);
    if (op == KMP_OP_SIN)
        return kmp_add(g, s, kmp_add(g, kmp_mul(g, c, sine), kmp_mul(g, s, versine)));
    return kmp_add(g, c, kmp_sub(g, kmp_mul(g, c, versine), kmp_mul(g, s, sine)));
}

/* -- import -------------------------------------------------------------------------------------------- */

bool kmp_program_import(const kmp_program *p, kmp_graph *g, const kmp_importing *how, kmp_ref *outputs)
{
    int leaves = p->constant_count + p->input_count, code = p->code[p->stages], stages = how->stages;
    stages = stages > 0 ? stages : p->stages;
    kmp_ref *value = KMP_NEW(kmp_ref, leaves + code), *at = how->at ? KMP_NEW(kmp_ref, leaves + code) : NULL;
    bool *needed = how->at ? KMP_NEW(bool, code) : NULL;
    bool made = value && (!how->at || (at && needed)) && import_leaves(p, g, how->count, how->input, how->by, value) &&
                (!at || import_leaves(p, g, how->count, how->input, how->at, at));
    if (made && needed)
        mark_needed(p, needed);
    if (made) {
        /* Values of all instructions. With `at`, values at the first place, sines and cosines come from there. */
        for (int i = 0; i < p->code[stages]; i++) {
            const kmp_instruction *in = &p->instruction[i];
            bool turned = at && (in->op == KMP_OP_SIN || in->op == KMP_OP_COS);
            if (at && needed[i])
                at[leaves + i] = import(p, g, in, at);
            value[leaves + i] = turned ? turn(g, (kmp_op)in->op, operand(at, in->a), operand(value, in->a), how->turns)
                                       : import(p, g, in, value);
        }
    }
    for (int k = 0; made && k < p->outputs[stages]; k++)
        outputs[k] = operand(value, p->output[k]);
    kmp_free(value);
    kmp_free(at);
    kmp_free(needed);
    return made && !kmp_graph_failed(g);
}
