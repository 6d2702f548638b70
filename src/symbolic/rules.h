/* SPDX-License-Identifier: BSD-3-Clause */
/* Simplifications made when a node is created (Fisette and Samin 1996, section 3.1). Each returns
 * true if it has a shorter form, in *result. The graph calls the active rules (kmp_graph_set_rules). */
#pragma once

#include "symbolic/graph.h"

/** KMP_RULE_ZERO: zeros, ones, arithmetic of numbers. a and b of products and quotients are without sign, `sign` is
 * that of the result; a product has its number first. */
bool kmp_sparse_tangent_add(kmp_graph *g, kmp_ref a, kmp_ref b, kmp_ref *result);
bool kmp_sparse_tangent_mul(kmp_graph *g, kmp_ref a, kmp_ref b, kmp_ref sign, kmp_ref *result);
bool kmp_sparse_tangent_div(kmp_graph *g, kmp_ref a, kmp_ref b, kmp_ref sign, kmp_ref *result);

/** KMP_RULE_CANCEL: a - a, 2 a + 3 a; (a + b) - a, and numbers of a sum with another. */
bool kmp_cancel_same(kmp_graph *g, kmp_ref a, kmp_ref b, kmp_ref *result);
bool kmp_cancel_in_sums(kmp_graph *g, kmp_ref a, kmp_ref b, kmp_ref *result);

/** KMP_RULE_SHARE, in addition to equal nodes: (p w) w = p (w w), without sign. */
bool kmp_squares(kmp_graph *g, kmp_ref a, kmp_ref b, kmp_ref *result);

/** KMP_RULE_TRIG, in addition to rotated pairs (symbolic/rotation.h): x cos^2 + x sin^2 = x, x a number. */
bool kmp_pythagoras(kmp_graph *g, kmp_ref a, kmp_ref b, kmp_ref *result);

/** r = coefficient * base, the coefficient a number; the base, without sign. */
static inline kmp_ref kmp_split_coefficient(const kmp_graph *g, kmp_ref r, double *coefficient)
{
    const kmp_node *n = kmp_graph_node(g, kmp_id(r));
    double sign = kmp_is_negative(r) ? -1 : 1;
    if (n->op == KMP_OP_MUL && kmp_is_const(g, n->a, coefficient)) {
        *coefficient *= sign;
        return n->b;
    }
    *coefficient = sign;
    return r & ~(kmp_ref)1;
}
