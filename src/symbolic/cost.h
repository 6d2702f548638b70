/* SPDX-License-Identifier: BSD-3-Clause */
/* The common cost of outputs, kept up to date while they are exchanged: each node counts once. */
#pragma once

#include "symbolic/graph.h"
#include "symbolic/stack.h"

typedef struct kmp_cost {
    const kmp_graph *graph;
    uint32_t *uses; /* of each node by outputs and used nodes */
    uint32_t nodes; /* capacity of `uses` */
    kmp_stack stack;
    int sum_price;   /* of the sine or cosine of a sum */
    long operations; /* + - * / of the nodes in use */
    long once;       /* the part of the cost that depends only on parameters */
    bool failed;     /* no memory */
} kmp_cost;

/** The sine or cosine of a sum is half an addition theorem, KMP_COST_ADDITION, until those are written out
 *  (symbolic/shorten.h); then it costs nothing. false: no memory. The graph may grow. */
enum { KMP_COST_ADDITION = 3 };
bool kmp_cost_init(kmp_cost *cost, const kmp_graph *g, int sum_price);
void kmp_cost_free(kmp_cost *cost);

/** Outputs come and go; each as often as it was added. */
void kmp_cost_add(kmp_cost *cost, int count, const kmp_ref *outputs);
void kmp_cost_remove(kmp_cost *cost, int count, const kmp_ref *outputs);

/** The common cost of fixed outputs, into a cost whose other members but graph and sum_price are zero, in less time
 * than kmp_cost_add takes. False: no memory. */
bool kmp_cost_total(kmp_cost *cost, int count, const kmp_ref *outputs);
/** The cost of these nodes themselves. */
long kmp_cost_of_nodes(const kmp_graph *g, int sum_price, uint32_t count, const uint32_t *ids);
