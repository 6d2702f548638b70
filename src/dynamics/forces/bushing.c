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
 * It is kr sin(a) n, V = kr (3 - tr R) / 2, where all kr_i are equal. Damping adds cr w, with cr w formed as kr s. */
#include "dynamics/forces/forces.h"
#include "dynamics/kinematics/kinematics_numbers.h"
#include "dynamics/kinematics/kinematics_vectors.h"
#include "dynamics/kinematics/link_tree.h"
#include "model/data/force.h"
#include <stdbool.h>

typedef struct bushing {
    const kmp_tree *tree;
    int frame;                /* link whose axes all vectors have */
    kmp_vec p[3], q[3];       /* axes */
    kmp_vec elongation, rate; /* d and its rate in the first body's axes */
    kmp_vec spin;             /* w */
} bushing;

static bool alike(const kmp_ref k[3])
{
    return k[0] == k[1] && k[1] == k[2];
}

/* sum_i x_i p_i */
static kmp_vec along_axes(const bushing *b, const kmp_ref x[3])
{
    kmp_graph *g = b->tree->graph;
    kmp_vec sum = kmp_vec_zero();
    for (int i = 0; i < 3; i++)
        sum = kmp_vec_add(g, sum, kmp_vec_scale(g, x[i], b->p[i]));
    return sum;
}

/* sum_i k_i (p_i.v) p_i */
static kmp_vec weigh(const bushing *b, const kmp_ref k[3], kmp_vec v)
{
    kmp_graph *g = b->tree->graph;
    kmp_ref x[3];
    if (alike(k))
        return kmp_vec_scale(g, k[0], v);
    for (int i = 0; i < 3; i++)
        x[i] = kmp_mul(g, k[i], k[i] == KMP_ZERO ? KMP_ZERO : kmp_vec_dot(g, b->p[i], v));
    return along_axes(b, x);
}

static void add_potential(kmp_forces *forces, kmp_graph *g, kmp_ref factor, kmp_vec a, kmp_vec b)
{
    forces->potential = kmp_add(g, forces->potential, kmp_mul(g, factor, kmp_vec_dot(g, a, b)));
}

/* f */
static kmp_vec pull(kmp_forces *forces, const bushing *b, const kmp_force *force, unsigned energy)
{
    kmp_graph *g = b->tree->graph;
    const kmp_vec k = kmp_tree_vector(b->tree, force->along), c = kmp_tree_vector(b->tree, force->along_damping);
    const kmp_vec preload = kmp_tree_vector(b->tree, force->preload);
    kmp_vec elastic = weigh(b, k.x, b->elongation), drag = weigh(b, c.x, b->rate), constant = along_axes(b, preload.x);
    if (energy & KMP_ENERGY_POTENTIAL) {
        add_potential(forces, g, kmp_const(g, 0.5), elastic, b->elongation);
        add_potential(forces, g, KMP_ONE, constant, b->elongation);
    }
    if (energy & KMP_ENERGY_POWER)
        forces->power = kmp_sub(g, forces->power, kmp_vec_dot(g, drag, b->rate));
    return kmp_vec_add(g, kmp_vec_add(g, elastic, constant), drag);
}

/* The elastic part of m. */
static kmp_vec turn_back(kmp_forces *forces, const bushing *b, const kmp_ref k[3], unsigned energy)
{
    kmp_graph *g = b->tree->graph;
    kmp_ref half = kmp_const(g, 0.5), trace = KMP_ZERO;
    kmp_vec s = kmp_vec_zero();
    if (alike(k) && k[0] == KMP_ZERO)
        return s;
    for (int i = 0; i < 3; i++) {
        s = kmp_vec_add(g, s, kmp_vec_cross(g, b->p[i], b->q[i]));
        trace = kmp_add(g, trace, kmp_vec_dot(g, b->p[i], b->q[i]));
    }
    s = kmp_vec_scale(g, half, s);
    kmp_vec weighed = weigh(b, k, s);
    if (alike(k)) {
        kmp_ref open = kmp_mul(g, half, kmp_sub(g, kmp_const(g, 3), trace));
        if (energy & KMP_ENERGY_POTENTIAL)
            forces->potential = kmp_add(g, forces->potential, kmp_mul(g, k[0], open));
        return weighed;
    }
    kmp_ref factor = kmp_div(g, kmp_const(g, 2), kmp_add(g, KMP_ONE, trace));
    if (energy & KMP_ENERGY_POTENTIAL)
        add_potential(forces, g, factor, s, weighed);
    return kmp_vec_add(g, weighed, kmp_vec_scale(g, factor, kmp_vec_cross(g, s, weighed)));
}

/* m */
static kmp_vec moment(kmp_forces *forces, const bushing *b, const kmp_force *force, unsigned energy)
{
    kmp_graph *g = b->tree->graph;
    const kmp_vec k = kmp_tree_vector(b->tree, force->about), c = kmp_tree_vector(b->tree, force->about_damping);
    kmp_vec drag = weigh(b, c.x, b->spin);
    if (energy & KMP_ENERGY_POWER)
        forces->power = kmp_sub(g, forces->power, kmp_vec_dot(g, drag, b->spin));
    return kmp_vec_add(g, turn_back(forces, b, k.x, energy), drag);
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
    kmp_apply_between(forces, tree, point, b.frame, f);
    kmp_apply_moment(forces, tree, point[0], b.frame, kmp_vec_add(g, m, kmp_vec_cross(g, b.elongation, f)));
    kmp_apply_moment(forces, tree, point[1], b.frame, kmp_vec_sub(g, kmp_vec_zero(), m));
    for (int i = 0; i < 3; i++) {
        value[i] = kmp_neg(kmp_vec_dot(g, b.p[i], f));
        value[3 + i] = kmp_neg(kmp_vec_dot(g, b.p[i], m));
    }
}
