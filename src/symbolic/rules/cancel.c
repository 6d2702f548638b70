/* SPDX-License-Identifier: BSD-3-Clause */
/* Cancellation: terms that differ by a numeric factor only become one. */
#include "symbolic/rules/rules.h"

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
