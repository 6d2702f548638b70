/* SPDX-License-Identifier: BSD-3-Clause */
/* Squares are collected: squares of rates occur in many terms. */
#include "symbolic/rules/rules.h"

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
