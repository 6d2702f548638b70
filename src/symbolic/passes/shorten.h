/* SPDX-License-Identifier: BSD-3-Clause */
/* The passes that shorten outputs when all of them are present; simplifications of a single node are made at its
 * creation (graph.c). */
#ifndef KMP_SYMBOLIC_PASSES_SHORTEN_H
#define KMP_SYMBOLIC_PASSES_SHORTEN_H

#include "symbolic/passes/collapse.h"

/** Rewrites the outputs in place; `parallel` (NULL: no coordinates) as in collapse.h. false: no memory. */
typedef bool kmp_pass_fn(kmp_graph *g, const kmp_parallel *parallel, int count, kmp_ref *outputs);

typedef struct kmp_pass {
    const char *name;
    kmp_pass_fn *run;
} kmp_pass;

/** The passes in order; *count of them. */
const kmp_pass *kmp_passes(int *count);

/** Runs all passes. Values are equal up to rounding. */
kmp_pass_fn kmp_shorten;

#endif
