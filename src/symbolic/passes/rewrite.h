/* SPDX-License-Identifier: BSD-3-Clause */
/* What passes over the outputs of a graph have in common: which nodes are needed, how often, and what they become. */
#ifndef KMP_SYMBOLIC_REWRITE_H
#define KMP_SYMBOLIC_REWRITE_H

#include "symbolic/graph.h"

typedef struct kmp_rewrite {
    kmp_graph *graph;
    uint32_t count; /* nodes that the graph had at the beginning */
    uint32_t *uses; /* of each by needed nodes and outputs; 0: not needed */
    kmp_ref *now;   /* what each needed node became */
} kmp_rewrite;

/** false: no memory. */
bool kmp_rewrite_init(kmp_rewrite *r, kmp_graph *g, int count, const kmp_ref *outputs);
void kmp_rewrite_free(kmp_rewrite *r);

/** What a reference became. */
static inline kmp_ref kmp_rewritten(const kmp_rewrite *r, kmp_ref x)
{
    return kmp_is_negative(x) ? kmp_neg(r->now[kmp_id(x)]) : r->now[kmp_id(x)];
}

/** The node with its operands as they became. */
kmp_ref kmp_rewrite_node(const kmp_rewrite *r, uint32_t id);

/** Exchanges the outputs for what they became when that takes fewer operations, by this price of the sine or cosine of
 *  a sum (symbolic/cost.h). false: no memory. */
bool kmp_rewrite_finish(kmp_rewrite *r, int sum_price, int count, kmp_ref *outputs);

enum { KMP_MOST_TERMS = 128 };

/** The terms of a sum (op ADD) or the factors of a product (op MUL) as a list, going into operands that nothing else
 *  needs as far as the list holds them, KMP_MOST_TERMS; its length. Factors are without sign: *sign collects theirs. */
int kmp_rewrite_flatten(const kmp_rewrite *r, kmp_op op, kmp_ref x, kmp_ref *list, kmp_ref *sign);

#endif
