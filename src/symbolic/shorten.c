/* SPDX-License-Identifier: BSD-3-Clause */
/* The list of passes over finished outputs, and the loop through it: addition theorems, trigonometric sums, common
 * factors, common parts of sums and of products. A pass is a row. */
#include "symbolic/shorten.h"
#include "symbolic/rewrite.h"

const kmp_pass kmp_passes[KMP_PASSES] = {{"trigonometric", kmp_collapse_trig},
                                         {"common factors", kmp_factor_sums},
                                         {"common parts of sums", kmp_share_sums},
                                         {"common parts of products", kmp_share_products}};

static bool run_all(kmp_rewrite *r, const kmp_parallel *parallel, int count, kmp_ref *outputs)
{
    bool ok = true;
    for (int k = 0; ok && k < KMP_PASSES; k++)
        ok = kmp_passes[k].run(r, parallel, count, outputs);
    return ok;
}

bool kmp_shorten(kmp_graph *g, const kmp_parallel *parallel, int count, kmp_ref *outputs)
{
    return kmp_rewrite_alone(g, run_all, parallel, count, outputs);
}
