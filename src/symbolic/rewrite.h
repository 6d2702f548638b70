/* SPDX-License-Identifier: BSD-3-Clause */
/* Common parts of passes over the outputs of a graph: the needed nodes, their number of uses, and their rewritten
 * forms. */
#pragma once

#include "symbolic/function_table.h"
#include "symbolic/shorten.h"
#include "symbolic/stack.h"

typedef struct kmp_rewrite {
    kmp_graph *graph;
    uint32_t count; /* nodes that the graph had when the present outputs were given; later ones are not needed */
    uint32_t *uses; /* of each node by needed nodes and outputs; 0: not needed */
    kmp_ref *now;   /* the rewritten form of each needed node; other entries have no meaning */
    uint32_t room;  /* length of `now` */
    kmp_stack live; /* the needed nodes, the first one last */
} kmp_rewrite;

/** One for all passes over the same outputs, one after another. false: no memory. kmp_rewrite_free in any case. */
bool kmp_rewrite_init(kmp_rewrite *r, kmp_graph *g, int count, const kmp_ref *outputs);
void kmp_rewrite_free(kmp_rewrite *r);

/** Needed node k, from 0, in the order of the graph. */
static inline uint32_t kmp_rewrite_live(const kmp_rewrite *r, uint32_t k)
{
    return r->live.id[r->live.top - 1 - k];
}

/** The rewritten form of a reference. */
static inline kmp_ref kmp_rewritten(const kmp_rewrite *r, kmp_ref x)
{
    return kmp_mapped(r->now, x);
}

/** The node with its operands as they became. */
static inline kmp_ref kmp_rewrite_node(const kmp_rewrite *r, uint32_t id)
{
    return kmp_graph_rebuild_by(r->graph, r->graph, id, r->now);
}

/** Takes the rewritten forms of the outputs when that takes fewer operations, by this price of the sine or cosine of a
 * sum (symbolic/cost.h): then these are the outputs, and their nodes those that the next pass needs. False: no
 * memory. */
bool kmp_rewrite_finish(kmp_rewrite *r, int sum_price, int count, kmp_ref *outputs);

/** Runs a pass by itself. */
bool kmp_rewrite_alone(kmp_graph *g, kmp_pass_fn *pass, const kmp_parallel *parallel, int count, kmp_ref *outputs);

/** A pass that rewrites sums, the operands of each first; other nodes follow. `user` is passed on to `rewrite`, which
 * returns the form of the sum `id`. */
typedef kmp_ref kmp_rewrite_sum(const kmp_rewrite *r, const void *user, uint32_t id);
bool kmp_rewrite_sums(kmp_rewrite *r, kmp_rewrite_sum *rewrite, const void *user, int sum_price, int count,
                      kmp_ref *outputs);

/** True if a reference is expanded in the list of another one, which alone has it. */
static inline bool kmp_rewrite_expands(const kmp_rewrite *r, kmp_op op, kmp_ref x)
{
    return kmp_graph_node(r->graph, kmp_id(x))->op == op && kmp_id(x) < r->count && r->uses[kmp_id(x)] == 1;
}

enum { KMP_MOST_TERMS = 128 };

/** The terms of a sum (op ADD) or the factors of a product (op MUL) as a list; returns its length. Operands without
 * other users are expanded as far as the list has room, KMP_MOST_TERMS. Factors are without sign: *sign is their
 * product's. */
int kmp_rewrite_flatten(const kmp_rewrite *r, kmp_op op, kmp_ref x, kmp_ref *list, kmp_ref *sign);
