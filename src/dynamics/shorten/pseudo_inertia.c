/* SPDX-License-Identifier: BSD-3-Clause */
#include "dynamics/shorten/pseudo_inertia.h"

/* P of K: tr(K)/2 1 - K. */
static kmp_tensor spread_of(kmp_graph *g, kmp_tensor k)
{
    kmp_ref trace = kmp_add(g, kmp_add(g, k.x[0], k.x[1]), k.x[2]), half = kmp_mul(g, kmp_const(g, 0.5), trace);
    kmp_tensor p;
    for (int i = 0; i < 3; i++) {
        p.x[i] = kmp_sub(g, half, k.x[i]);
        p.x[3 + i] = kmp_neg(k.x[3 + i]);
    }
    return p;
}

void kmp_spread_out(kmp_tree *tree)
{
    tree->spread = true;
    for (int i = 1; i < tree->count; i++)
        tree->links[i].base.inertia = spread_of(tree->graph, tree->links[i].base.inertia);
}

kmp_vec kmp_spread_column(kmp_graph *g, kmp_tensor p, int axis)
{
    int j = (axis + 1) % 3, k = (axis + 2) % 3;
    kmp_vec column;
    column.x[axis] = kmp_add(g, p.x[j], p.x[k]);
    column.x[j] = kmp_neg(p.x[kmp_tensor_at[axis][j]]);
    column.x[k] = kmp_neg(p.x[kmp_tensor_at[axis][k]]);
    return column;
}

/* d b' + b d', or that with b for b' and m d d'. */
kmp_composite kmp_spread_shifted(kmp_graph *g, kmp_composite c, kmp_vec d)
{
    kmp_vec b = c.moment, other;
    if (kmp_vec_is_zero(d))
        return c;
    bool numbers = kmp_composite_moved(g, &c, d, &other);
    for (int i = 0; i < 3; i++) {
        int j = (i + 1) % 3;
        kmp_ref *mixed = &c.inertia.x[kmp_tensor_at[i][j]], *own = &c.inertia.x[i], md = kmp_mul(g, c.mass, d.x[i]);
        *own = kmp_add(g, *own, kmp_composite_both(g, d.x[i], b.x[i], other.x[i]));
        *mixed = kmp_add(g, *mixed, kmp_add(g, kmp_mul(g, d.x[i], other.x[j]), kmp_mul(g, b.x[i], d.x[j])));
        if (!numbers)
            continue;
        *own = kmp_add(g, *own, kmp_mul(g, md, d.x[i]));
        *mixed = kmp_add(g, *mixed, kmp_mul(g, md, d.x[j]));
    }
    return c;
}
