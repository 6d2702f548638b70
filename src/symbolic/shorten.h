/* SPDX-License-Identifier: BSD-3-Clause */
/* The passes that shorten outputs when all of them are present; simplifications of a single node are made at its
 * creation (graph.c). Each rewrites the outputs in place, all but kmp_trig_sums where it takes fewer operations. False:
 * no memory. */
#pragma once

#include "symbolic/graph.h"

/** Coordinates that rotate about parallel axes, by runs; -1: not in a run. */
typedef struct kmp_parallel {
    const int *run;
    int count;
} kmp_parallel;

struct kmp_rewrite;

/** A pass over the outputs, whose needed nodes `r` has (symbolic/rewrite.h), and then those of the new outputs.
 * `parallel` may be NULL: no axes are parallel. */
typedef bool kmp_pass_fn(struct kmp_rewrite *r, const kmp_parallel *parallel, int count, kmp_ref *outputs);

typedef struct kmp_pass {
    const char *name;
    kmp_pass_fn *run;
} kmp_pass;

/** The passes in order. */
enum { KMP_PASSES = 5 };
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
 * alone. */
kmp_pass_fn kmp_collapse_trig;

/** Factors taken out of sums: a b + a c = a (b + c). Products that other nodes also need are left alone. */
kmp_pass_fn kmp_factor_sums;

/** Common parts of sums or products, independent of the order in which they were written. With a + b + c and d + a + c,
 * a + c is made once. */
kmp_pass_fn kmp_share_sums, kmp_share_products;
