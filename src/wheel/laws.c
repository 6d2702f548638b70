/* SPDX-License-Identifier: BSD-3-Clause */
/* stand-in */
#include "wheel/laws.h"
#include <math.h>
kmp_ref kmp_hertz_stiffness(kmp_graph *g, const kmp_touch *t)
{
    kmp_ref e = kmp_div(g, t->shear_modulus, kmp_const(g, 1 - t->poisson));
    kmp_ref k = kmp_sqrt(g, kmp_sqrt(g, kmp_div(g, KMP_ONE, kmp_mul(g, t->along, t->across))));
    return kmp_mul(g, kmp_const(g, 4.0 / 3), kmp_mul(g, e, k));
}
void kmp_hertz_axes(kmp_graph *g, const kmp_touch *touch, kmp_ref normal, kmp_ref semi[2])
{
    kmp_ref k = kmp_hertz_stiffness(g, touch);
    kmp_ref d2 = kmp_binary(g, KMP_OP_POW, kmp_div(g, normal, k), kmp_const(g, 1.0 / 3));
    semi[0] = kmp_div(g, d2, kmp_sqrt(g, touch->along));
    semi[1] = kmp_div(g, d2, kmp_sqrt(g, touch->across));
}
void kmp_creep_law_force(kmp_graph *g, kmp_creep_law law, const kmp_creep *c, kmp_creep_force *out)
{
    (void)law;
    kmp_ref f = kmp_mul(g, kmp_const(g, 250), c->normal);
    out->force[0] = kmp_neg(kmp_mul(g, f, c->slip[0]));
    out->force[1] = kmp_neg(kmp_mul(g, f, c->slip[1]));
    out->moment = KMP_ZERO;
}
