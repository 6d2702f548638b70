/* SPDX-License-Identifier: BSD-3-Clause */
/* Symmetric tensors and matrices in turned axes: R t R'. */
#pragma once

#include "dynamics/kinematics/vector.h"

/** Symmetric tensor: xx yy zz xy xz yz. */
typedef struct kmp_tensor {
    kmp_ref x[6];
} kmp_tensor;

/** A 3 x 3 matrix without symmetry, by rows. */
typedef struct kmp_matrix {
    kmp_ref x[3][3];
} kmp_matrix;

static inline kmp_vec kmp_vec_of_row(const kmp_matrix *m, int i)
{
    return (kmp_vec){{m->x[i][0], m->x[i][1], m->x[i][2]}};
}
static inline kmp_vec kmp_vec_of_column(const kmp_matrix *m, int j)
{
    return (kmp_vec){{m->x[0][j], m->x[1][j], m->x[2][j]}};
}

/** The index of entry (i, j) of a tensor. */
extern const int kmp_tensor_at[3][3];

kmp_vec kmp_tensor_apply(kmp_graph *g, kmp_tensor t, kmp_vec a);
kmp_tensor kmp_tensor_add(kmp_graph *g, kmp_tensor a, kmp_tensor b);
/** m (a.b) 1 - m/2 (a b' + b a'): with a = b, the tensor that a mass at a adds about the origin. */
kmp_tensor kmp_tensor_steiner(kmp_graph *g, kmp_ref m, kmp_vec a, kmp_vec b);
/** m v, or m' v. */
kmp_vec kmp_matrix_apply(kmp_graph *g, const kmp_matrix *m, bool transposed, kmp_vec v);

/** R about a coordinate axis by an angle. */
kmp_tensor kmp_tensor_turn(kmp_graph *g, int axis, kmp_ref angle, kmp_tensor t);
kmp_matrix kmp_matrix_turn(kmp_graph *g, int axis, kmp_ref angle, kmp_matrix m);

/** Rotates by a given R. */
kmp_tensor kmp_tensor_turn_by(kmp_graph *g, kmp_matrix r, kmp_tensor t);
kmp_matrix kmp_matrix_turn_by(kmp_graph *g, kmp_matrix r, kmp_matrix m);
