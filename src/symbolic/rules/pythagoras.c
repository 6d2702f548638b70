/* SPDX-License-Identifier: BSD-3-Clause */
#include "symbolic/rules/rules.h"

/* True for f(x)^2 with f = op; x in *argument. */
static bool is_square_of(const kmp_graph *g, kmp_ref r, kmp_op op, kmp_ref *argument)
{
    const kmp_node *n = kmp_graph_node(g, kmp_id(r));
    if (n->op != KMP_OP_MUL || n->a != n->b || kmp_graph_node(g, kmp_id(n->a))->op != op)
        return false;
    *argument = kmp_graph_node(g, kmp_id(n->a))->a;
    return true;
}

bool kmp_pythagoras(kmp_graph *g, kmp_ref a, kmp_ref b, kmp_ref *result)
{
    double x, y;
    kmp_ref p = kmp_split_coefficient(g, a, &x), q = kmp_split_coefficient(g, b, &y), v, w;
    bool squares = (is_square_of(g, p, KMP_OP_SIN, &v) && is_square_of(g, q, KMP_OP_COS, &w)) ||
                   (is_square_of(g, p, KMP_OP_COS, &v) && is_square_of(g, q, KMP_OP_SIN, &w));
    if (x != y || !squares || v != w)
        return false;
    *result = kmp_const(g, x);
    return true;
}
