/* SPDX-License-Identifier: BSD-3-Clause */
/* Vectors, tensors, matrices and composite bodies of the graph: the words that the formalisms are written in. */
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
/** The vector with these components along three axes. */
kmp_vec kmp_vec_along(kmp_graph *g, const kmp_ref x[3], const kmp_vec axes[3]);

/* The last operand is evaluated first. */
#define kmp_vec_add(g, a, b)   KMP_LAST_FIRST(kmp_vec_add, g, a, b)
#define kmp_vec_sub(g, a, b)   KMP_LAST_FIRST(kmp_vec_sub, g, a, b)
#define kmp_vec_scale(g, s, a) KMP_LAST_FIRST(kmp_vec_scale, g, s, a)
#define kmp_vec_dot(g, a, b)   KMP_LAST_FIRST(kmp_vec_dot, g, a, b)
#define kmp_vec_cross(g, a, b) KMP_LAST_FIRST(kmp_vec_cross, g, a, b)

/* -- symmetric tensors and matrices in turned axes: R t R' ---------------------------------------------- */

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

/* -- rigid bodies that move together as one body ------------------------------------------------------ */

/** Mass, first and second moments about a point. */
typedef struct kmp_composite {
    kmp_ref mass;
    kmp_vec moment;     /* sum m x */
    kmp_tensor inertia; /* K = sum m (x.x 1 - x x') */
} kmp_composite;

/** The moments of a body with its centre of mass at `com` and its inertia about that point. */
kmp_composite kmp_composite_of(kmp_graph *g, kmp_ref mass, kmp_vec com, kmp_tensor inertia);

kmp_composite kmp_composite_add(kmp_graph *g, kmp_composite a, kmp_composite b);

/** The moments about a point d before the composite's own. */
kmp_composite kmp_composite_shifted(kmp_graph *g, kmp_composite c, kmp_vec d);
