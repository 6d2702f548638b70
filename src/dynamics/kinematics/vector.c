/* SPDX-License-Identifier: BSD-3-Clause */
/* Vectors and tensors over the graph. Symmetric tensors turn about one axis by pairs of entries, and composite bodies
 * shift by products that share their terms, which are the operation counts of Fisette and Samin 1996. */
#include "dynamics/kinematics/vector.h"
#include "symbolic/function_table.h"
#include "symbolic/trig.h"

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

kmp_vec kmp_vec_along(kmp_graph *g, const kmp_ref x[3], const kmp_vec axes[3])
{
    kmp_vec sum = kmp_vec_scale(g, x[0], axes[0]);
    for (int k = 1; k < 3; k++)
        sum = kmp_vec_add(g, sum, kmp_vec_scale(g, x[k], axes[k]));
    return sum;
}

/* -- tensors and matrices ------------------------------------------------------------------------------ */

const int kmp_tensor_at[3][3] = {{0, 3, 4}, {3, 1, 5}, {4, 5, 2}};
static const int row_of[6] = {0, 1, 2, 0, 0, 1}, column_of[6] = {0, 1, 2, 1, 2, 2};

kmp_vec kmp_tensor_apply(kmp_graph *g, kmp_tensor t, kmp_vec a)
{
    kmp_vec r;
    for (int i = 0; i < 3; i++) {
        r.x[i] = kmp_mul(g, t.x[kmp_tensor_at[i][0]], a.x[0]);
        for (int j = 1; j < 3; j++)
            r.x[i] = kmp_add(g, r.x[i], kmp_mul(g, t.x[kmp_tensor_at[i][j]], a.x[j]));
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
            t.x[kmp_tensor_at[i][j]] = kmp_neg(p == q ? p : kmp_mul(g, half, kmp_add(g, p, q)));
        }
    return t;
}

kmp_vec kmp_matrix_apply(kmp_graph *g, const kmp_matrix *m, bool transposed, kmp_vec v)
{
    kmp_vec r = kmp_vec_zero();
    for (int i = 0; i < 3; i++)
        for (int j = 0; j < 3; j++)
            r.x[i] = kmp_add(g, r.x[i], kmp_mul(g, transposed ? m->x[j][i] : m->x[i][j], v.x[j]));
    return r;
}

/* Rotation of a tensor about one axis. The entries that mix the axis with the other two rotate as pairs. For the
 * remaining 2 x 2 block (a b; c d), w = s (a - d) + (b + c) cos gives a - s w, d + s w, c w - c and c w - b. */
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
        out.x[k] =
            kmp_vec_dot(g, kmp_vec_of_row(&r, row_of[k]), kmp_tensor_apply(g, t, kmp_vec_of_row(&r, column_of[k])));
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
            column.x[n] = kmp_vec_dot(g, kmp_vec_of_row(&m, n), kmp_vec_of_row(&r, j));
        for (int n = 0; n < 3; n++)
            out.x[n][j] = kmp_vec_dot(g, kmp_vec_of_row(&r, n), column);
    }
    return out;
}

/* -- composite bodies ---------------------------------------------------------------------------------- */

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
