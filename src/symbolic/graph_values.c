/* SPDX-License-Identifier: BSD-3-Clause */
/* Digests and values of the nodes of a graph. */
#include "symbolic/implicit.h"
#include "symbolic/table_function.h"
#include <math.h>
#include <string.h>

/* -- digests --------------------------------------------------------------------------------------- */

static uint64_t stir(uint64_t digest, uint64_t more)
{
    digest = (digest ^ more) * 0x9e3779b97f4a7c15u;
    return digest ^ digest >> 29;
}

static uint64_t bits_of(double value)
{
    uint64_t bits;
    memcpy(&bits, &value, sizeof bits);
    return bits;
}

uint64_t kmp_graph_digest(const kmp_graph *g, uint32_t first, int count, const kmp_ref *outputs)
{
    uint64_t digest = stir(kmp_graph_count(g), (uint64_t)count);
    for (uint32_t id = first; id < kmp_graph_count(g); id++) {
        const kmp_node *n = kmp_graph_node(g, id);
        uint64_t whole = (uint64_t)n->b << 32 | n->c;
        if (n->op == KMP_OP_CONST)
            whole = bits_of(kmp_graph_value(g, id));
        digest = stir(stir(digest, (uint64_t)n->a << 8 | n->op), whole);
    }
    for (int k = 0; k < count; k++)
        digest = stir(digest, outputs[k]);
    return digest;
}

bool kmp_graph_begins_as(const kmp_graph *g, const kmp_graph *other)
{
    uint32_t count = kmp_graph_count(other);
    if (count > kmp_graph_count(g))
        return false;
    for (int k = 0; kmp_graph_table(other, k); k++)
        if (kmp_graph_table(g, k) != kmp_graph_table(other, k))
            return false;
    for (uint32_t id = 0; id < count; id++) {
        const kmp_node *n = kmp_graph_node(g, id), *m = kmp_graph_node(other, id);
        if (n->op != m->op || n->a != m->a || n->b != m->b || n->c != m->c ||
            (n->op == KMP_OP_CONST && bits_of(kmp_graph_value(g, id)) != bits_of(kmp_graph_value(other, id))))
            return false;
    }
    return true;
}

/* -- values ---------------------------------------------------------------------------------------- */

static double operand(const double *value, kmp_ref r)
{
    return kmp_is_negative(r) ? -value[kmp_id(r)] : value[kmp_id(r)];
}

static double value_of(const kmp_graph *g, const kmp_node *n, const double *value)
{
    double x[3] = {0};
    for (int k = 0; k < kmp_op_arity((kmp_op)n->op); k++)
        x[k] = operand(value, kmp_operand(n, k));
    if (n->op == KMP_OP_IMPLICIT) {
        const kmp_program_block *block = kmp_implicit_block(kmp_graph_implicit(g, (int)n->b));
        kmp_solving *solving = kmp_solving_new(block, NULL);
        double y = NAN;
        kmp_ref list = n->a;
        for (int l = 0; solving && l < block->arguments; l++, list = kmp_graph_node(g, kmp_id(list))->b)
            kmp_solving_arguments(solving)[l] = operand(value, kmp_graph_node(g, kmp_id(list))->a);
        if (solving)
            y = kmp_solving_value(solving, (int)n->c);
        kmp_solving_free(solving);
        return y;
    }
    if (n->op == KMP_OP_TABLE)
        return kmp_table_value(kmp_graph_table(g, (int)n->b), (int)n->c, x[0]);
    return kmp_op_value((kmp_op)n->op, x[0], x[1], x[2]);
}

void kmp_graph_eval(const kmp_graph *g, const double *const inputs[KMP_IN_COUNT], double *value)
{
    for (uint32_t id = 0; id < kmp_graph_count(g); id++) {
        const kmp_node *n = kmp_graph_node(g, id);
        if (n->op == KMP_OP_CONST)
            value[id] = kmp_graph_value(g, id);
        else if (n->op == KMP_OP_INPUT)
            value[id] = inputs[n->a] ? inputs[n->a][n->b] : NAN;
        else
            value[id] = value_of(g, n, value);
    }
}
