/* SPDX-License-Identifier: BSD-3-Clause */
#include "symbolic/passes/shorten.h"

static bool write_out_sums(kmp_graph *g, const kmp_parallel *parallel, int count, kmp_ref *outputs)
{
    (void)parallel;
    return kmp_trig_sums(g, count, outputs);
}

static bool factor(kmp_graph *g, const kmp_parallel *parallel, int count, kmp_ref *outputs)
{
    (void)parallel;
    return kmp_factor_sums(g, count, outputs);
}

static bool share_sums(kmp_graph *g, const kmp_parallel *parallel, int count, kmp_ref *outputs)
{
    (void)parallel;
    return kmp_share_pairs(g, KMP_OP_ADD, count, outputs);
}

static bool share_products(kmp_graph *g, const kmp_parallel *parallel, int count, kmp_ref *outputs)
{
    (void)parallel;
    return kmp_share_pairs(g, KMP_OP_MUL, count, outputs);
}

static const kmp_pass passes[] = {{"addition theorems", write_out_sums},
                                  {"trigonometric", kmp_collapse_trig},
                                  {"common factors", factor},
                                  {"common parts of sums", share_sums},
                                  {"common parts of products", share_products}};

enum { PASSES = sizeof passes / sizeof *passes };

const kmp_pass *kmp_passes(int *count)
{
    *count = PASSES;
    return passes;
}

bool kmp_shorten(kmp_graph *g, const kmp_parallel *parallel, int count, kmp_ref *outputs)
{
    bool ok = true;
    for (int k = 0; ok && k < PASSES; k++)
        ok = passes[k].run(g, parallel, count, outputs);
    return ok;
}
