/* SPDX-License-Identifier: BSD-3-Clause */
#include "dynamics/kinematics/vector.h"

bool kmp_vec_is_zero(kmp_vec a)
{
    return a.x[0] == KMP_ZERO && a.x[1] == KMP_ZERO && a.x[2] == KMP_ZERO;
}

kmp_vec kmp_vec_add(kmp_graph *g, kmp_vec a, kmp_vec b)
{
    for (int i = 0; i < 3; i++)
        a.x[i] = kmp_add(g, a.x[i], b.x[i]);
    return a;
}

kmp_vec kmp_vec_sub(kmp_graph *g, kmp_vec a, kmp_vec b)
{
    for (int i = 0; i < 3; i++)
        a.x[i] = kmp_sub(g, a.x[i], b.x[i]);
    return a;
}

kmp_vec kmp_vec_scale(kmp_graph *g, kmp_ref s, kmp_vec a)
{
    for (int i = 0; i < 3; i++)
        a.x[i] = kmp_mul(g, s, a.x[i]);
    return a;
}

kmp_ref kmp_vec_dot(kmp_graph *g, kmp_vec a, kmp_vec b)
{
    kmp_ref r = kmp_mul(g, a.x[0], b.x[0]);
    for (int i = 1; i < 3; i++)
        r = kmp_add(g, r, kmp_mul(g, a.x[i], b.x[i]));
    return r;
}

kmp_vec kmp_vec_cross(kmp_graph *g, kmp_vec a, kmp_vec b)
{
    kmp_vec r;
    for (int i = 0; i < 3; i++) {
        int j = (i + 1) % 3, k = (i + 2) % 3;
        r.x[i] = kmp_sub(g, kmp_mul(g, a.x[j], b.x[k]), kmp_mul(g, a.x[k], b.x[j]));
    }
    return r;
}

kmp_vec kmp_vec_axis(kmp_ref s, int k)
{
    kmp_vec r = kmp_vec_zero();
    r.x[k] = s;
    return r;
}

/* The index of entry (i, j) in a tensor. */
static const int at[3][3] = {{0, 3, 4}, {3, 1, 5}, {4, 5, 2}};

kmp_vec kmp_tensor_apply(kmp_graph *g, kmp_tensor t, kmp_vec a)
{
    kmp_vec r;
    for (int i = 0; i < 3; i++) {
        r.x[i] = kmp_mul(g, t.x[at[i][0]], a.x[0]);
        for (int j = 1; j < 3; j++)
            r.x[i] = kmp_add(g, r.x[i], kmp_mul(g, t.x[at[i][j]], a.x[j]));
    }
    return r;
}

kmp_tensor kmp_tensor_add(kmp_graph *g, kmp_tensor a, kmp_tensor b)
{
    for (int k = 0; k < 6; k++)
        a.x[k] = kmp_add(g, a.x[k], b.x[k]);
    return a;
}

kmp_tensor kmp_tensor_steiner(kmp_graph *g, kmp_ref m, kmp_vec a, kmp_vec b)
{
    kmp_vec mb = kmp_vec_scale(g, m, b);
    kmp_ref d[3], half = kmp_const(g, 0.5);
    kmp_tensor t;
    for (int i = 0; i < 3; i++)
        d[i] = kmp_mul(g, a.x[i], mb.x[i]);
    for (int i = 0; i < 3; i++)
        t.x[i] = kmp_add(g, d[(i + 1) % 3], d[(i + 2) % 3]);
    for (int i = 0; i < 3; i++)
        for (int j = i + 1; j < 3; j++) {
            kmp_ref p = kmp_mul(g, a.x[i], mb.x[j]), q = kmp_mul(g, a.x[j], mb.x[i]);
            t.x[at[i][j]] = kmp_neg(p == q ? p : kmp_mul(g, half, kmp_add(g, p, q)));
        }
    return t;
}
