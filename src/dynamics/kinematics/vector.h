/* SPDX-License-Identifier: BSD-3-Clause */
/* Three-component vectors and 3 x 3 constant matrices of the graph: the words that the formalisms are written in. */
#ifndef KMP_DYNAMICS_KINEMATICS_VECTOR_H
#define KMP_DYNAMICS_KINEMATICS_VECTOR_H

#include "symbolic/graph.h"

typedef struct kmp_vec {
    kmp_ref x[3];
} kmp_vec;

/** Symmetric tensor: xx yy zz xy xz yz. */
typedef struct kmp_tensor {
    kmp_ref x[6];
} kmp_tensor;

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
kmp_vec kmp_tensor_apply(kmp_graph *g, kmp_tensor t, kmp_vec a);
kmp_tensor kmp_tensor_add(kmp_graph *g, kmp_tensor a, kmp_tensor b);
/** m (a.b) 1 - m/2 (a b' + b a'): with a = b, the tensor that a mass at a adds about the origin. */
kmp_tensor kmp_tensor_steiner(kmp_graph *g, kmp_ref m, kmp_vec a, kmp_vec b);

#endif
