/* SPDX-License-Identifier: BSD-3-Clause */
/* The rules of the graph: zeros and ones, cancellation of terms, squares collected, and sin^2 + cos^2 = 1. Each looks
 * one or two levels deep, since it runs for every node that is made. */
#include "symbolic/rules.h"

/* -- zeros ------------------------------------------------------------------------------------------ */

/* Zero elimination: zeros and ones vanish, numbers are computed at once and come first in a product. */

bool kmp_sparse_tangent_add(kmp_graph *g, kmp_ref a, kmp_ref b, kmp_ref *result)
{
    double x, y;
    if (a == KMP_ZERO)
        *result = b;
    else if (b == KMP_ZERO)
        *result = a;
    else if (kmp_is_const(g, a, &x) && kmp_is_const(g, b, &y))
        *result = kmp_const(g, x + y);
    else
        return false;
    return true;
}

bool kmp_sparse_tangent_mul(kmp_graph *g, kmp_ref a, kmp_ref b, kmp_ref sign, kmp_ref *result)
{
    double x, y;
    if (a == KMP_ZERO || b == KMP_ZERO) {
        *result = KMP_ZERO;
        return true;
    }
    if (a == KMP_ONE || b == KMP_ONE) {
        *result = (a == KMP_ONE ? b : a) ^ sign;
        return true;
    }
    if (!kmp_is_const(g, a, &x))
        return false;
    if (kmp_is_const(g, b, &y)) {
        *result = kmp_const(g, sign ? -x * y : x * y);
        return true;
    }
    kmp_ref base = kmp_split_coefficient(g, b, &y);
    if (base == b)
        return false;
    *result = kmp_mul(g, kmp_const(g, sign ? -x * y : x * y), base);
    return true;
}

bool kmp_sparse_tangent_div(kmp_graph *g, kmp_ref a, kmp_ref b, kmp_ref sign, kmp_ref *result)
{
    double x, y;
    if (kmp_is_const(g, b, &y)) {
        bool number = kmp_is_const(g, a, &x);
        *result = number ? kmp_const(g, sign ? -x / y : x / y) : kmp_mul(g, a, kmp_const(g, sign ? -1 / y : 1 / y));
        return true;
    }
    *result = KMP_ZERO;
    return a == KMP_ZERO;
}

/* -- cancellation ----------------------------------------------------------------------------------- */

/* Cancellation: terms that differ by a numeric factor only become one. */

bool kmp_cancel_same(kmp_graph *g, kmp_ref a, kmp_ref b, kmp_ref *result)
{
    double x, y;
    *result = KMP_ZERO;
    if (a == kmp_neg(b))
        return true;
    kmp_ref p = kmp_split_coefficient(g, a, &x), q = kmp_split_coefficient(g, b, &y);
    if (p != q)
        return false;
    *result = kmp_mul(g, kmp_const(g, x + y), p);
    return true;
}

/* (p + q) + b where b cancels p or q, or where p and b are numbers. */
static bool add_to_sum(kmp_graph *g, kmp_ref sum, kmp_ref b, kmp_ref *result)
{
    kmp_node n = *kmp_graph_node(g, kmp_id(sum));
    double x, y;
    if (n.op != KMP_OP_ADD)
        return false;
    kmp_ref p = kmp_is_negative(sum) ? kmp_neg(n.a) : n.a;
    kmp_ref q = kmp_is_negative(sum) ? kmp_neg(n.b) : n.b;
    if (p == kmp_neg(b))
        *result = q;
    else if (q == kmp_neg(b))
        *result = p;
    else if (kmp_is_const(g, p, &x) && kmp_is_const(g, b, &y))
        *result = kmp_add(g, kmp_const(g, x + y), q);
    else
        return false;
    return true;
}

bool kmp_cancel_in_sums(kmp_graph *g, kmp_ref a, kmp_ref b, kmp_ref *result)
{
    return add_to_sum(g, a, b, result) || add_to_sum(g, b, a, result);
}

/* -- squares ---------------------------------------------------------------------------------------- */

/* Squares are collected: squares of rates occur in many terms. */

static bool is_number(const kmp_graph *g, kmp_ref r)
{
    return kmp_graph_node(g, kmp_id(r))->op == KMP_OP_CONST;
}

static bool collect(kmp_graph *g, kmp_ref product, kmp_ref w, kmp_ref *result)
{
    kmp_node n = *kmp_graph_node(g, kmp_id(product));
    if (n.op != KMP_OP_MUL || is_number(g, w))
        return false;
    if (n.b == w && n.a != w)
        *result = kmp_mul(g, n.a, kmp_mul(g, w, w));
    else if (n.a == w && n.b != w)
        *result = kmp_mul(g, n.b, kmp_mul(g, w, w));
    else
        return false;
    return true;
}

bool kmp_squares(kmp_graph *g, kmp_ref a, kmp_ref b, kmp_ref *result)
{
    return collect(g, a, b, result) || collect(g, b, a, result);
}

/* -- sums of squares -------------------------------------------------------------------------------- */

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
