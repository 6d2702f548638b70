/* SPDX-License-Identifier: BSD-3-Clause */
/* Rotation of a tensor about one axis. The entries that mix the axis with the other two rotate as pairs. For the
 * remaining 2 x 2 block (a b; c d), w = s (a - d) + (b + c) cos gives a - s w, d + s w, c w - c and c w - b. */
#include "dynamics/kinematics/tensor.h"
#include "symbolic/rotation.h"

const int kmp_tensor_at[3][3] = {{0, 3, 4}, {3, 1, 5}, {4, 5, 2}};
static const int row_of[6] = {0, 1, 2, 0, 0, 1}, column_of[6] = {0, 1, 2, 1, 2, 2};

typedef struct block {
    kmp_ref a, b, c, d;
} block;

static block turned_block(kmp_graph *g, kmp_ref angle, block m)
{
    kmp_ref s = kmp_sin(g, angle), c = kmp_cos(g, angle), both = kmp_add(g, m.b, m.c);
    kmp_ref w = kmp_add(g, kmp_mul(g, s, kmp_sub(g, m.a, m.d)), kmp_mul(g, both, c)), cw = kmp_mul(g, c, w);
    kmp_ref sw = kmp_mul(g, s, w);
    return (block){kmp_sub(g, m.a, sw), kmp_sub(g, cw, m.c), kmp_sub(g, cw, m.b), kmp_add(g, m.d, sw)};
}

static kmp_vec row(const kmp_matrix *m, int i)
{
    return (kmp_vec){{m->x[i][0], m->x[i][1], m->x[i][2]}};
}

kmp_tensor kmp_tensor_turn(kmp_graph *g, int axis, kmp_ref angle, kmp_tensor t)
{
    int p = (axis + 1) % 3, q = (axis + 2) % 3;
    if (angle == KMP_ZERO)
        return t;
    kmp_ref xy = t.x[kmp_tensor_at[p][q]];
    block b = turned_block(g, angle, (block){t.x[p], xy, xy, t.x[q]});
    kmp_rotate(g, angle, &t.x[kmp_tensor_at[axis][p]], &t.x[kmp_tensor_at[axis][q]]);
    t.x[p] = b.a;
    t.x[kmp_tensor_at[p][q]] = b.b;
    t.x[q] = b.d;
    return t;
}

kmp_tensor kmp_tensor_turn_by(kmp_graph *g, kmp_matrix r, kmp_tensor t)
{
    kmp_tensor out;
    for (int k = 0; k < 6; k++) /* r t r', by its columns */
        out.x[k] = kmp_vec_dot(g, row(&r, row_of[k]), kmp_tensor_apply(g, t, row(&r, column_of[k])));
    return out;
}

kmp_matrix kmp_matrix_turn(kmp_graph *g, int axis, kmp_ref angle, kmp_matrix m)
{
    int p = (axis + 1) % 3, q = (axis + 2) % 3;
    if (angle == KMP_ZERO)
        return m;
    block b = turned_block(g, angle, (block){m.x[p][p], m.x[p][q], m.x[q][p], m.x[q][q]});
    kmp_rotate(g, angle, &m.x[axis][p], &m.x[axis][q]);
    kmp_rotate(g, angle, &m.x[p][axis], &m.x[q][axis]);
    m.x[p][p] = b.a;
    m.x[p][q] = b.b;
    m.x[q][p] = b.c;
    m.x[q][q] = b.d;
    return m;
}

kmp_matrix kmp_matrix_turn_by(kmp_graph *g, kmp_matrix r, kmp_matrix m)
{
    kmp_matrix out;
    for (int j = 0; j < 3; j++) {
        kmp_vec column;
        for (int n = 0; n < 3; n++)
            column.x[n] = kmp_vec_dot(g, row(&m, n), row(&r, j));
        for (int n = 0; n < 3; n++)
            out.x[n][j] = kmp_vec_dot(g, row(&r, n), column);
    }
    return out;
}
