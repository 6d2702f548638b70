/* SPDX-License-Identifier: BSD-3-Clause */
/* The list of passes over finished outputs, and the loop through it: addition theorems, trigonometric sums, common
 * factors, common parts of sums and of products. A pass is a row. */
#include "symbolic/shorten.h"
#include "symbolic/rewrite.h"
#include "symbolic/trig.h"

static bool write_out_sums(kmp_rewrite *r, const kmp_parallel *parallel, int count, kmp_ref *outputs)
{
    kmp_graph *g = r->graph;
    uint8_t *live = KMP_NEW(uint8_t, r->count);
    bool changed = false;
    (void)parallel;
    for (uint32_t k = 0; live && k < r->live.top; k++)
        live[r->live.id[k]] = 1;
    bool ok = live && kmp_trig_sums_of(g, r->count, live, count, outputs, &changed);
    kmp_free(live);
    if (!ok || !changed)
        return ok;
    kmp_rewrite_free(r);
    return kmp_rewrite_init(r, g, count, outputs);
}

const kmp_pass kmp_passes[KMP_PASSES] = {{"addition theorems", write_out_sums},
                                         {"trigonometric", kmp_collapse_trig},
                                         {"common factors", kmp_factor_sums},
                                         {"common parts of sums", kmp_share_sums},
                                         {"common parts of products", kmp_share_products}};

bool kmp_pass_run(const kmp_pass *pass, kmp_graph *g, const kmp_parallel *parallel, int count, kmp_ref *outputs)
{
    return kmp_rewrite_alone(g, pass->run, parallel, count, outputs);
}

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
