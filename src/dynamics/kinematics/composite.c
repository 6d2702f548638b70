/* SPDX-License-Identifier: BSD-3-Clause */
#include "dynamics/kinematics/composite.h"

kmp_composite kmp_composite_of(kmp_graph *g, kmp_ref mass, kmp_vec com, kmp_tensor inertia)
{
    return (kmp_composite){.mass = mass,
                           .moment = kmp_vec_scale(g, mass, com),
                           .inertia = kmp_tensor_add(g, inertia, kmp_tensor_steiner(g, mass, com, com))};
}

kmp_composite kmp_composite_add(kmp_graph *g, kmp_composite a, kmp_composite b)
{
    return (kmp_composite){.mass = kmp_add(g, a.mass, b.mass),
                           .moment = kmp_vec_add(g, a.moment, b.moment),
                           .inertia = kmp_tensor_add(g, a.inertia, b.inertia)};
}

static bool is_number(const kmp_graph *g, kmp_ref r)
{
    return kmp_graph_node(g, kmp_id(r))->op == KMP_OP_CONST;
}

/* d (a + b): 2 d, mostly a number or a parameter, once if both are one. */
static kmp_ref both(kmp_graph *g, kmp_ref d, kmp_ref a, kmp_ref b)
{
    return a == b ? kmp_mul(g, kmp_mul(g, kmp_const(g, 2), d), a) : kmp_mul(g, d, kmp_add(g, a, b));
}

/* With b' = b + m d: (d.(b + b')) 1 - (d b' + b d'), which is symmetric. If m and d are numbers, 2 d.b 1 - (d b +
 * b d) and, separately, m (d.d 1 - d d'), which then joins other constants. */
kmp_composite kmp_composite_shifted(kmp_graph *g, kmp_composite c, kmp_vec d)
{
    kmp_vec b = c.moment;
    kmp_ref s[3];
    if (kmp_vec_is_zero(d))
        return c;
    const bool numbers = is_number(g, c.mass) && is_number(g, d.x[0]) && is_number(g, d.x[1]) && is_number(g, d.x[2]);
    c.moment = kmp_vec_add(g, b, kmp_vec_scale(g, c.mass, d));
    const kmp_vec other = numbers ? b : c.moment;
    for (int i = 0; i < 3; i++)
        s[i] = both(g, d.x[i], b.x[i], other.x[i]);
    for (int i = 0; i < 3; i++) {
        int j = (i + 1) % 3;
        kmp_ref *mixed = &c.inertia.x[kmp_tensor_at[i][j]], *own = &c.inertia.x[i];
        *mixed = kmp_sub(g, *mixed, kmp_add(g, kmp_mul(g, d.x[i], other.x[j]), kmp_mul(g, b.x[i], d.x[j])));
        *own = kmp_add(g, *own, kmp_add(g, s[j], s[(i + 2) % 3]));
    }
    if (numbers)
        c.inertia = kmp_tensor_add(g, c.inertia, kmp_tensor_steiner(g, c.mass, d, d));
    return c;
}
