/* SPDX-License-Identifier: BSD-3-Clause */
/* Three-component vectors of the graph: the words that the formalisms are written in. */
#pragma once

#include "symbolic/graph.h"

typedef struct kmp_vec {
    kmp_ref x[3];
} kmp_vec;

static inline kmp_vec kmp_vec_zero(void)
{
    return (kmp_vec){{KMP_ZERO, KMP_ZERO, KMP_ZERO}};
}

bool kmp_vec_is_zero(kmp_vec a);
kmp_vec kmp_vec_add(kmp_graph *g, kmp_vec a, kmp_vec b);
kmp_vec kmp_vec_sub(kmp_graph *g, kmp_vec a, kmp_vec b);
kmp_vec kmp_vec_scale(kmp_graph *g, kmp_ref s, kmp_vec a);
kmp_ref kmp_vec_dot(kmp_graph *g, kmp_vec a, kmp_vec b);
kmp_vec kmp_vec_cross(kmp_graph *g, kmp_vec a, kmp_vec b);
/** s times unit vector k. */
kmp_vec kmp_vec_axis(kmp_ref s, int k);

/* The last operand is evaluated first. */
#define kmp_vec_add(g, a, b)   KMP_LAST_FIRST(kmp_vec_add, g, a, b)
#define kmp_vec_sub(g, a, b)   KMP_LAST_FIRST(kmp_vec_sub, g, a, b)
#define kmp_vec_scale(g, s, a) KMP_LAST_FIRST(kmp_vec_scale, g, s, a)
#define kmp_vec_dot(g, a, b)   KMP_LAST_FIRST(kmp_vec_dot, g, a, b)
#define kmp_vec_cross(g, a, b) KMP_LAST_FIRST(kmp_vec_cross, g, a, b)
