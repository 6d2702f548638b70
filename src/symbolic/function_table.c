/* SPDX-License-Identifier: BSD-3-Clause */
/* Constructors of all operations except arithmetic, and their simplifications: numbers, signs of odd and even
 * functions, choices that are already decided. */
#include "symbolic/function_table.h"
#include "symbolic/implicit.h"
#include "symbolic/ops.h"
#include "symbolic/table_function.h"
#include <math.h>

kmp_ref kmp_unary(kmp_graph *g, kmp_op op, kmp_ref a)
{
    double x;
    if (kmp_is_const(g, a, &x))
        return kmp_const(g, kmp_op_value(op, x, 0, 0));
    kmp_ref sign = kmp_op_parity_of(op) == KMP_PARITY_ODD ? a & 1 : 0;
    if (kmp_op_parity_of(op) != KMP_PARITY_NONE)
        a &= ~(kmp_ref)1;
    return kmp_graph_intern(g, (kmp_node){.op = (uint8_t)op, .a = a}) ^ sign;
}

kmp_ref kmp_sin(kmp_graph *g, kmp_ref a)
{
    return kmp_unary(g, KMP_OP_SIN, a);
}

kmp_ref kmp_cos(kmp_graph *g, kmp_ref a)
{
    return kmp_unary(g, KMP_OP_COS, a);
}

kmp_ref kmp_sqrt(kmp_graph *g, kmp_ref a)
{
    return kmp_unary(g, KMP_OP_SQRT, a);
}

static kmp_ref whole_power(kmp_graph *g, kmp_ref a, unsigned n)
{
    kmp_ref r = KMP_ONE;
    for (; n; n >>= 1, a = kmp_mul(g, a, a))
        if (n & 1)
            r = kmp_mul(g, r, a);
    return r;
}

kmp_ref kmp_power(kmp_graph *g, kmp_ref a, double exponent)
{
    double x, e = fabs(exponent);
    kmp_ref r;
    if (kmp_is_const(g, a, &x))
        return kmp_const(g, pow(x, exponent));
    if (e <= 64 && e == floor(e))
        r = whole_power(g, a, (unsigned)e);
    else if (e <= 64 && 2 * e == floor(2 * e))
        r = kmp_mul(g, whole_power(g, a, (unsigned)e), kmp_sqrt(g, a));
    else
        return kmp_graph_intern(g, (kmp_node){.op = KMP_OP_POW, .a = a, .b = kmp_const(g, exponent)});
    return exponent < 0 ? kmp_div(g, KMP_ONE, r) : r;
}

/* A negative number or zero, by its sign bit. */
static bool is_turned(kmp_ref r)
{
    return r == KMP_ZERO || kmp_is_negative(r);
}

kmp_ref(kmp_less)(kmp_graph *g, kmp_ref a, kmp_ref b)
{
    double x, y;
    if (kmp_is_const(g, a, &x) && kmp_is_const(g, b, &y))
        return kmp_const(g, x < y ? 1 : 0);
    if (a == b)
        return KMP_ZERO;
    if (is_turned(a) && is_turned(b)) { /* -p < -q is q < p */
        kmp_ref c = kmp_neg(a);
        a = kmp_neg(b);
        b = c;
    }
    return kmp_graph_intern(g, (kmp_node){.op = KMP_OP_LESS, .a = a, .b = b});
}

kmp_ref(kmp_binary)(kmp_graph *g, kmp_op op, kmp_ref a, kmp_ref b)
{
    double x, y;
    bool number = kmp_is_const(g, b, &y);
    if (op == KMP_OP_LESS)
        return kmp_less(g, a, b);
    if (op == KMP_OP_POW && number)
        return kmp_power(g, a, y);
    if (op != KMP_OP_LIST && number && kmp_is_const(g, a, &x))
        return kmp_const(g, kmp_op_value(op, x, y, 0));
    if (a == b && (op == KMP_OP_MIN || op == KMP_OP_MAX))
        return a;
    return kmp_graph_intern(g, (kmp_node){.op = (uint8_t)op, .a = a, .b = b});
}

kmp_ref(kmp_select)(kmp_graph *g, kmp_ref condition, kmp_ref x, kmp_ref y)
{
    double c;
    if (kmp_is_const(g, condition, &c))
        return c != 0 ? x : y;
    if (x == y)
        return x;
    condition &= ~(kmp_ref)1;
    const kmp_node *n = kmp_graph_node(g, kmp_id(condition));
    if (n->op == KMP_OP_SELECT && n->b == KMP_ZERO && n->c == KMP_ONE) /* not c ? x : y */
        return kmp_select(g, n->a, y, x);
    if (n->op == KMP_OP_LESS && x == KMP_ONE && y == KMP_ZERO)
        return condition;
    kmp_ref sign = x & y & 1;
    return kmp_graph_intern(g, (kmp_node){.op = KMP_OP_SELECT, .a = condition, .b = x ^ sign, .c = y ^ sign}) ^ sign;
}

kmp_ref kmp_operate(kmp_graph *g, kmp_op op, const kmp_ref operands[3])
{
    switch (op) {
    case KMP_OP_ADD:
        return kmp_add(g, operands[0], operands[1]);
    case KMP_OP_MUL:
        return kmp_mul(g, operands[0], operands[1]);
    case KMP_OP_DIV:
        return kmp_div(g, operands[0], operands[1]);
    case KMP_OP_SELECT:
        return kmp_select(g, operands[0], operands[1], operands[2]);
    default:
        return kmp_op_arity(op) == 1 ? kmp_unary(g, op, operands[0]) : kmp_binary(g, op, operands[0], operands[1]);
    }
}

kmp_ref kmp_graph_rebuild(kmp_graph *to, const kmp_graph *from, uint32_t id, const kmp_ref operands[3])
{
    kmp_node n = *kmp_graph_node(from, id);
    if (n.op == KMP_OP_ADD)
        return kmp_add(to, operands[0], operands[1]);
    if (n.op == KMP_OP_MUL)
        return kmp_mul(to, operands[0], operands[1]);
    if (n.op == KMP_OP_TABLE) {
        int table = to == from ? (int)n.b : kmp_graph_add_table(to, kmp_graph_table(from, (int)n.b));
        return kmp_table_derivative_at(to, table, (int)n.c, operands[0]);
    }
    if (n.op == KMP_OP_IMPLICIT && to == from)
        return kmp_implicit_component(to, (int)n.b, (int)n.c, operands[0]);
    if (n.op == KMP_OP_IMPLICIT)
        kmp_graph_fail(to);
    return kmp_operate(to, (kmp_op)n.op, operands);
}

kmp_ref kmp_graph_rebuild_by(kmp_graph *to, const kmp_graph *from, uint32_t id, const kmp_ref *map)
{
    const kmp_node *n = kmp_graph_node(from, id);
    int arity = kmp_op_arity((kmp_op)n->op);
    if (arity == 2) { /* most nodes */
        kmp_ref operands[3] = {kmp_mapped(map, n->a), kmp_mapped(map, n->b)};
        return to == from && operands[0] == n->a && operands[1] == n->b ? id << 1
                                                                        : kmp_graph_rebuild(to, from, id, operands);
    }
    kmp_ref operands[3] = {0};
    bool same = to == from;
    for (int k = 0; k < arity; k++) {
        operands[k] = kmp_mapped(map, kmp_operand(n, k));
        same = same && operands[k] == kmp_operand(n, k);
    }
    return same ? id << 1 : kmp_graph_rebuild(to, from, id, operands);
}

kmp_ref kmp_table_derivative_at(kmp_graph *g, int table, int derivative, kmp_ref x)
{
    double value;
    const kmp_table *t = kmp_graph_table(g, table);
    if (!t || derivative > kmp_table_degree(t))
        return KMP_ZERO;
    if (kmp_is_const(g, x, &value))
        return kmp_const(g, kmp_table_value(t, derivative, value));
    return kmp_graph_intern(g, (kmp_node){.op = KMP_OP_TABLE, .a = x, .b = (uint32_t)table, .c = (uint32_t)derivative});
}

kmp_ref kmp_table_at(kmp_graph *g, int table, kmp_ref x)
{
    return kmp_table_derivative_at(g, table, 0, x);
}
