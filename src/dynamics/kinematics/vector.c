/* SPDX-License-Identifier: BSD-3-Clause */
#include "dynamics/kinematics/vector.h"

bool kmp_vec_is_zero(kmp_vec a)
{
    return a.x[0] == KMP_ZERO && a.x[1] == KMP_ZERO && a.x[2] == KMP_ZERO;
}

kmp_vec(kmp_vec_add)(kmp_graph *g, kmp_vec a, kmp_vec b)
{
    for (int i = 0; i < 3; i++)
        a.x[i] = kmp_add(g, a.x[i], b.x[i]);
    return a;
}

kmp_vec(kmp_vec_sub)(kmp_graph *g, kmp_vec a, kmp_vec b)
{
    for (int i = 0; i < 3; i++)
        a.x[i] = kmp_sub(g, a.x[i], b.x[i]);
    return a;
}

kmp_vec(kmp_vec_scale)(kmp_graph *g, kmp_ref s, kmp_vec a)
{
    for (int i = 0; i < 3; i++)
        a.x[i] = kmp_mul(g, s, a.x[i]);
    return a;
}

kmp_ref(kmp_vec_dot)(kmp_graph *g, kmp_vec a, kmp_vec b)
{
    kmp_ref r = kmp_mul(g, a.x[0], b.x[0]);
    for (int i = 1; i < 3; i++)
        r = kmp_add(g, r, kmp_mul(g, a.x[i], b.x[i]));
    return r;
}

kmp_vec(kmp_vec_cross)(kmp_graph *g, kmp_vec a, kmp_vec b)
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
