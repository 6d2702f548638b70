/* SPDX-License-Identifier: BSD-3-Clause */
/* The passes that shorten outputs when all of them are present; simplifications of a single node are made at its
 * creation (graph.c). Each rewrites the outputs in place, all but kmp_trig_sums where it takes fewer operations. False:
 * no memory. */
#pragma once

#include "symbolic/function_table.h"
#include "symbolic/graph.h"
#include "symbolic/stack.h"

/** Coordinates that rotate about parallel axes, by runs; -1: not in a run. */
typedef struct kmp_parallel {
    const int *run;
    int count;
} kmp_parallel;

/** The needed nodes of the outputs, their number of uses, and their rewritten forms. */
typedef struct kmp_rewrite {
    kmp_graph *graph;
    uint32_t count; /* nodes that the graph had when the present outputs were given; later ones are not needed */
    uint32_t *uses; /* of each node by needed nodes and outputs; 0: not needed */
    kmp_ref *now;   /* the rewritten form of each needed node; other entries have no meaning */
    uint32_t room;  /* length of `now` */
    kmp_stack live; /* the needed nodes, the first one last */
} kmp_rewrite;

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

/** A pass over the outputs, whose needed nodes `r` has, and then the nodes of the new outputs.
 * `parallel` may be NULL: no axes are parallel. */
typedef bool kmp_pass_fn(kmp_rewrite *r, const kmp_parallel *parallel, int count, kmp_ref *outputs);

typedef struct kmp_pass {
    const char *name;
    kmp_pass_fn *run;
} kmp_pass;

/** The passes in order. */
enum { KMP_PASSES = 4 };
extern const kmp_pass kmp_passes[KMP_PASSES];

/** Runs all passes. Values are equal up to rounding. */
bool kmp_shorten(kmp_graph *g, const kmp_parallel *parallel, int count, kmp_ref *outputs);
/** Runs a pass by itself. */
bool kmp_pass_run(const kmp_pass *pass, kmp_graph *g, const kmp_parallel *parallel, int count, kmp_ref *outputs);

/** Trigonometric simplification of sums of products (Fisette and Samin 1996, section 3.1):
 *
 *     x cos^2 a + x sin^2 a = x
 *     x cos a cos b -+ x sin a sin b = x cos(a +- b)
 *     x sin a cos b +- x cos a sin b = x sin(a +- b)
 *
 * The second and third lines make new angles, which pays where axes are parallel: angles of unrelated joints are left
 * unchanged. */
kmp_pass_fn kmp_collapse_trig;

/** Factors taken out of sums: a b + a c = a (b + c). Products that other nodes also need are left unchanged. */
kmp_pass_fn kmp_factor_sums;

/** Common parts of sums or products, independent of the order in which they were written. With a + b + c and d + a + c,
 * a + c is made once. */
kmp_pass_fn kmp_share_sums, kmp_share_products;

/** Takes the rewritten forms of the outputs when that takes fewer operations, by this price of the sine or cosine of a
 * sum (symbolic/cost.h): then these are the outputs, and the next pass needs their nodes. False: no
 * memory. */
bool kmp_rewrite_finish(kmp_rewrite *r, int sum_price, int count, kmp_ref *outputs);

/** Runs a pass by itself. */
bool kmp_rewrite_alone(kmp_graph *g, kmp_pass_fn *pass, const kmp_parallel *parallel, int count, kmp_ref *outputs);

/** A pass that rewrites sums, the operands of each first; other nodes follow. `user` is passed on to `rewrite`, which
 * returns the form of the sum `id`. */
typedef kmp_ref kmp_rewrite_sum(const kmp_rewrite *r, const void *user, uint32_t id);
bool kmp_rewrite_sums(kmp_rewrite *r, kmp_rewrite_sum *rewrite, const void *user, int sum_price, int count,
                      kmp_ref *outputs);

/** True if a reference is expanded in the list of the only other one that has it. */
static inline bool kmp_rewrite_expands(const kmp_rewrite *r, kmp_op op, kmp_ref x)
{
    return kmp_graph_node(r->graph, kmp_id(x))->op == op && kmp_id(x) < r->count && r->uses[kmp_id(x)] == 1;
}

enum { KMP_MOST_TERMS = 128 };

/** The terms of a sum (op ADD) or the factors of a product (op MUL) as a list; returns its length. Operands without
 * other users are expanded as far as the list has room, KMP_MOST_TERMS. Factors are without sign: *sign is their
 * product's. */
int kmp_rewrite_flatten(const kmp_rewrite *r, kmp_op op, kmp_ref x, kmp_ref *list, kmp_ref *sign);
