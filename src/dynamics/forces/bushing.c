/* SPDX-License-Identifier: BSD-3-Clause */
/* Bushing between two points with axes. p_i and q_i are the axes of the first and of the second point. d is the vector
 * from the first to the second, and d' its rate in the first body's axes. The second point receives the force
 *
 *     f = sum_i (preload_i + k_i p_i.d + c_i p_i.d') p_i,     potential sum_i preload_i p_i.d + k_i (p_i.d)^2 / 2
 *
 * and the first body -f at the same place. The rotation R between the axes, by an angle a about n, has a potential in
 * Euler parameters (Nikravesh 1988, ch. 6),
 *
 *     V = sum_i kr_i psi_i^2 / 2,     psi = 2 sin(a/2) n = 2 s / sqrt(1 + tr R),     s = sin(a) n = sum_i p_i x q_i / 2
 *
 * which is smooth up to half a turn and equal as seen from either body. With dV/dt = w . m, w the angular velocity of
 * the second body relative to the first, and e' = (e0 w + w x e) / 2 of the Euler parameters e0, e = psi / 2, the
 * second body receives the restoring moment
 *
 *     m = kr s + 2 / (1 + tr R) s x (kr s),     kr s = sum_i kr_i (p_i.s) p_i,     V = 2 s.(kr s) / (1 + tr R).
 *
 * It is kr sin(a) n, V = kr (3 - tr R) / 2, where all kr_i are equal. Damping adds cr w, with cr w formed as kr s.
 *
 * With a matrix, k and kr are its blocks, and its other blocks couple d and psi: with K the upper one, V = d.(K psi), f
 * = K psi, and psi' = e0 w + w x e gives m = e0 g + e x g of g = K' d. The same blocks of damping couple d' and w. A
 * matrix that is not symmetric has no V: the power of its elastic force is added to the power of damping. */
#include "dynamics/forces/forces.h"
#include "dynamics/kinematics/kinematics_numbers.h"
#include "dynamics/kinematics/kinematics_vectors.h"
#include "dynamics/kinematics/link_tree.h"
#include "model/data/bushing_matrix.h"
#include "model/data/force.h"
#include "symbolic/function_table.h"
#include <stdbool.h>

typedef struct bushing {
    const kmp_tree *tree;
    int frame;                /* link whose axes all vectors have */
    kmp_vec p[3], q[3];       /* axes */
    kmp_vec elongation, rate; /* d and its rate in the first body's axes */
    kmp_vec spin;             /* w */
} bushing;

/* Three by three coefficients, rows and columns in the axes of the first point. */
typedef struct block {
    kmp_ref x[3][3];
} block;

static bool is_diagonal(const block *k)
{
    for (int i = 0; i < 3; i++)
        for (int j = 0; j < 3; j++)
            if (i != j && k->x[i][j] != KMP_ZERO)
                return false;
    return true;
}

/* A multiple of the unit matrix. */
static bool is_round(const block *k)
{
    return is_diagonal(k) && k->x[0][0] == k->x[1][1] && k->x[1][1] == k->x[2][2];
}

static bool is_nothing(const block *k)
{
    return is_round(k) && k->x[0][0] == KMP_ZERO;
}

static block block_of(const kmp_tree *tree, const kmp_force *force, kmp_bushing_kind kind, int row, int column)
{
    block k = {{{KMP_ZERO}}};
    for (int i = 0; i < 3; i++)
        for (int j = 0; j < 3; j++)
            k.x[i][j] =
                force->matrix && force->matrix->given[kind]
                    ? kmp_tree_number(tree, &force->matrix->of[kind][KMP_BUSHING_SIZE * (3 * row + i) + 3 * column + j])
                    : KMP_ZERO;
    return k;
}

/* On the diagonal: from the matrix, or from three numbers. */
static block own_block(const kmp_tree *tree, const kmp_force *force, kmp_bushing_kind kind, int row,
                       const kmp_number numbers[3])
{
    block k = {{{KMP_ZERO}}};
    if (force->matrix)
        return block_of(tree, force, kind, row, row);
    const kmp_vec diagonal = kmp_tree_vector(tree, numbers);
    for (int i = 0; i < 3; i++)
        for (int j = 0; j < 3; j++)
            k.x[i][j] = i == j ? diagonal.x[i] : KMP_ZERO;
    return k;
}

/* sum_i k_ij (p_j.v) p_i */
static kmp_vec weigh(const bushing *b, const block *k, kmp_vec v)
{
    kmp_graph *g = b->tree->graph;
    kmp_ref x[3] = {KMP_ZERO, KMP_ZERO, KMP_ZERO};
    if (is_round(k))
        return kmp_vec_scale(g, k->x[0][0], v);
    for (int i = 0; i < 3; i++)
        for (int j = 0; j < 3; j++)
            if (k->x[i][j] != KMP_ZERO)
                x[i] = kmp_add(g, x[i], kmp_mul(g, k->x[i][j], kmp_vec_dot(g, b->p[j], v)));
    return kmp_vec_along(g, x, b->p);
}

static void add_potential(kmp_forces *forces, kmp_graph *g, kmp_ref factor, kmp_vec a, kmp_vec b)
{
    forces->potential = kmp_add(g, forces->potential, kmp_mul(g, factor, kmp_vec_dot(g, a, b)));
}

static void add_power(kmp_forces *forces, kmp_graph *g, kmp_vec effort, kmp_vec rate)
{
    forces->power = kmp_sub(g, forces->power, kmp_vec_dot(g, effort, rate));
}

/* True if the elastic force has no potential. */
static bool is_external(const kmp_force *force)
{
    return force->matrix && force->matrix->nonsymmetric;
}

/* f, without couplings. */
static kmp_vec pull(kmp_forces *forces, const bushing *b, const kmp_force *force, unsigned energy)
{
    kmp_graph *g = b->tree->graph;
    const block k = own_block(b->tree, force, KMP_BUSHING_STIFFNESS, 0, force->along);
    const block c = own_block(b->tree, force, KMP_BUSHING_DAMPING, 0, force->along_damping);
    const kmp_vec preload = kmp_tree_vector(b->tree, force->preload);
    kmp_vec elastic = weigh(b, &k, b->elongation), drag = weigh(b, &c, b->rate),
            constant = kmp_vec_along(g, preload.x, b->p);
    if (energy & KMP_ENERGY_POTENTIAL) {
        if (!is_external(force))
            add_potential(forces, g, kmp_const(g, 0.5), elastic, b->elongation);
        add_potential(forces, g, KMP_ONE, constant, b->elongation);
    }
    if (energy & KMP_ENERGY_POWER) {
        add_power(forces, g, drag, b->rate);
        if (is_external(force))
            add_power(forces, g, elastic, b->rate);
    }
    return kmp_vec_add(g, kmp_vec_add(g, elastic, constant), drag);
}

/* s and tr R. */
static kmp_vec turned(const bushing *b, kmp_ref *trace)
{
    kmp_graph *g = b->tree->graph;
    kmp_vec s = kmp_vec_zero();
    *trace = KMP_ZERO;
    for (int i = 0; i < 3; i++) {
        s = kmp_vec_add(g, s, kmp_vec_cross(g, b->p[i], b->q[i]));
        *trace = kmp_add(g, *trace, kmp_vec_dot(g, b->p[i], b->q[i]));
    }
    return kmp_vec_scale(g, kmp_const(g, 0.5), s);
}

/* The elastic part of m; its potential, if it has one. */
static kmp_vec turn_back(kmp_forces *forces, const bushing *b, const block *k, bool potential)
{
    kmp_graph *g = b->tree->graph;
    kmp_ref half = kmp_const(g, 0.5), trace;
    if (is_nothing(k))
        return kmp_vec_zero();
    kmp_vec s = turned(b, &trace), weighed = weigh(b, k, s);
    if (is_round(k)) {
        kmp_ref open = kmp_mul(g, half, kmp_sub(g, kmp_const(g, 3), trace));
        if (potential)
            forces->potential = kmp_add(g, forces->potential, kmp_mul(g, k->x[0][0], open));
        return weighed;
    }
    kmp_ref factor = kmp_div(g, kmp_const(g, 2), kmp_add(g, KMP_ONE, trace));
    if (potential)
        add_potential(forces, g, factor, s, weighed);
    return kmp_vec_add(g, weighed, kmp_vec_scale(g, factor, kmp_vec_cross(g, s, weighed)));
}

/* m, without couplings. */
static kmp_vec moment(kmp_forces *forces, const bushing *b, const kmp_force *force, unsigned energy)
{
    kmp_graph *g = b->tree->graph;
    const block k = own_block(b->tree, force, KMP_BUSHING_STIFFNESS, 1, force->about);
    const block c = own_block(b->tree, force, KMP_BUSHING_DAMPING, 1, force->about_damping);
    const bool external = is_external(force);
    kmp_vec drag = weigh(b, &c, b->spin);
    if (energy & KMP_ENERGY_POWER)
        add_power(forces, g, drag, b->spin);
    kmp_vec elastic = turn_back(forces, b, &k, (energy & KMP_ENERGY_POTENTIAL) && !external);
    if (external && energy & KMP_ENERGY_POWER)
        add_power(forces, g, elastic, b->spin);
    return kmp_vec_add(g, elastic, drag);
}

/* Adds what displacements do to the moment and rotations to the force. */
static void couple(kmp_forces *forces, const bushing *b, const kmp_force *force, unsigned energy, kmp_vec *f,
                   kmp_vec *m)
{
    kmp_graph *g = b->tree->graph;
    const block across = block_of(b->tree, force, KMP_BUSHING_STIFFNESS, 0, 1);
    const block back = block_of(b->tree, force, KMP_BUSHING_STIFFNESS, 1, 0);
    const block drag_across = block_of(b->tree, force, KMP_BUSHING_DAMPING, 0, 1);
    const block drag_back = block_of(b->tree, force, KMP_BUSHING_DAMPING, 1, 0);
    kmp_vec pulled = kmp_vec_zero(), turning = pulled;
    if (!is_nothing(&across) || !is_nothing(&back)) {
        kmp_ref trace, half = kmp_const(g, 0.5);
        kmp_vec s = turned(b, &trace);
        kmp_ref root = kmp_sqrt(g, kmp_add(g, KMP_ONE, trace));
        kmp_vec e = kmp_vec_scale(g, kmp_div(g, KMP_ONE, root), s);
        pulled = weigh(b, &across, kmp_vec_scale(g, kmp_const(g, 2), e));
        kmp_vec effort = weigh(b, &back, b->elongation);
        turning = kmp_vec_add(g, kmp_vec_scale(g, kmp_mul(g, half, root), effort), kmp_vec_cross(g, e, effort));
        if (energy & KMP_ENERGY_POTENTIAL && !is_external(force))
            add_potential(forces, g, KMP_ONE, pulled, b->elongation);
        if (energy & KMP_ENERGY_POWER && is_external(force)) {
            add_power(forces, g, pulled, b->rate);
            add_power(forces, g, turning, b->spin);
        }
    }
    kmp_vec drag = weigh(b, &drag_across, b->spin), stop = weigh(b, &drag_back, b->rate);
    if (energy & KMP_ENERGY_POWER) {
        add_power(forces, g, drag, b->rate);
        add_power(forces, g, stop, b->spin);
    }
    *f = kmp_vec_add(g, *f, kmp_vec_add(g, pulled, drag));
    *m = kmp_vec_add(g, *m, kmp_vec_add(g, turning, stop));
}

void kmp_law_bushing(kmp_forces *forces, const kmp_tree *tree, const kmp_force *force, unsigned energy, kmp_ref *value)
{
    kmp_graph *g = tree->graph;
    const int *point = force->point;
    /* Places, axes and rates in the axes of the common ancestor. */
    bushing b = {.tree = tree};
    int link[2] = {kmp_point_link(tree, point[0]), kmp_point_link(tree, point[1])};
    b.elongation = kmp_point_difference(tree, point[0], point[1], &b.frame);
    kmp_point_axes(tree, point[0], b.frame, b.p);
    kmp_point_axes(tree, point[1], b.frame, b.q);
    kmp_vec first = kmp_link_spin(tree, link[0], b.frame);
    b.spin = kmp_vec_sub(g, kmp_link_spin(tree, link[1], b.frame), first);
    b.rate = kmp_vec_sub(g, kmp_vec_rate(tree, b.elongation), kmp_vec_cross(g, first, b.elongation));
    kmp_vec f = pull(forces, &b, force, energy), m = moment(forces, &b, force, energy);
    if (force->matrix)
        couple(forces, &b, force, energy, &f, &m);
    kmp_apply_between(forces, tree, point, b.frame, f);
    kmp_apply_moment(forces, tree, point[0], b.frame, kmp_vec_add(g, m, kmp_vec_cross(g, b.elongation, f)));
    kmp_apply_moment(forces, tree, point[1], b.frame, kmp_vec_sub(g, kmp_vec_zero(), m));
    for (int i = 0; i < 3; i++) {
        value[i] = kmp_neg(kmp_vec_dot(g, b.p[i], f));
        value[3 + i] = kmp_neg(kmp_vec_dot(g, b.p[i], m));
    }
}
