/* SPDX-License-Identifier: BSD-3-Clause */
/* The sum of all force elements: a table of laws by kind, completed by the wings, each of which adds its wrenches,
 * efforts and energy. Gravity is not a force here: it accelerates the ground in the recursions, and has only its
 * potential. */
#include "dynamics/forces/forces.h"
#include "base/wings.h"
#include "dynamics/forces/law.h"
#include "dynamics/kinematics/kinematics_vectors.h"
#include "dynamics/kinematics/link_tree.h"
#include "model/data/body.h"
#include "model/data/force.h"

static kmp_force_law *const laws[KMP_FORCE_KINDS] = {
#define KMP_FORCE(kind, name, place, word, width)         kmp_law_##name,
#define KMP_FORCE_OF_WING(kind, name, place, word, width) NULL,
#define KMP_FIELD(...)
#include "model/data/force_kinds.def"
#undef KMP_FORCE
#undef KMP_FIELD
};

static const kmp_law_row *row_of_wing(kmp_force_kind kind)
{
    for (const kmp_wing *const *wing = kmp_wings; *wing; wing++)
        for (const kmp_law_row *row = (*wing)->laws; row && row->law; row++)
            if (row->kind == kind)
                return row;
    return NULL;
}

/* The reader refuses forces whose wing is not in the build. */
static kmp_force_law *law_of(kmp_force_kind kind)
{
    return laws[kind] ? laws[kind] : row_of_wing(kind)->law;
}

kmp_force_place *kmp_force_place_of(kmp_force_kind kind)
{
    const kmp_law_row *row = row_of_wing(kind);
    return row ? row->place : NULL;
}

void kmp_apply_at(const kmp_tree *tree, int point, int frame, kmp_vec force, kmp_wrench *applied)
{
    kmp_graph *g = tree->graph;
    int link = kmp_point_link(tree, point);
    if (link == 0)
        return;
    force = kmp_from_ancestor(tree, link, frame, force);
    kmp_vec moment = kmp_vec_cross(g, kmp_point_local(tree, point), force);
    applied[link].force = kmp_vec_add(g, applied[link].force, force);
    applied[link].moment = kmp_vec_add(g, applied[link].moment, moment);
}

void kmp_apply_between(kmp_forces *forces, const kmp_tree *tree, const int point[2], int frame, kmp_vec force)
{
    kmp_apply_at(tree, point[0], frame, force, forces->applied);
    kmp_apply_at(tree, point[1], frame, kmp_vec_sub(tree->graph, kmp_vec_zero(), force), forces->applied);
}

void kmp_apply_moment(kmp_forces *forces, const kmp_tree *tree, int point, int frame, kmp_vec moment)
{
    int link = kmp_point_link(tree, point);
    kmp_vec *sum = &forces->applied[link].moment;
    if (link > 0)
        *sum = kmp_vec_add(tree->graph, *sum, kmp_from_ancestor(tree, link, frame, moment));
}

void kmp_apply_effort(kmp_forces *forces, const kmp_tree *tree, int motion, kmp_ref effort)
{
    forces->effort[motion] = kmp_add(tree->graph, forces->effort[motion], effort);
}

void kmp_add_power(kmp_forces *forces, const kmp_tree *tree, kmp_ref effort, kmp_ref rate)
{
    forces->power = kmp_add(tree->graph, forces->power, kmp_mul(tree->graph, effort, rate));
}

/* - m g.x of every body, x in ground axes. */
static kmp_ref potential_of_gravity(const kmp_tree *tree)
{
    kmp_graph *g = tree->graph;
    kmp_ref v = KMP_ZERO;
    for (int i = 1; i < tree->count; i++) {
        if (tree->links[i].mass == KMP_ZERO)
            continue;
        kmp_vec x = tree->links[i].com;
        for (int k = i; k > 0; k = tree->links[k].parent) {
            x = kmp_link_to_parent(tree, k, kmp_vec_add(g, x, kmp_link_slide(tree, k)));
            x = kmp_vec_add(g, x, tree->links[k].p);
        }
        v = kmp_sub(g, v, kmp_mul(g, tree->links[i].mass, kmp_vec_dot(g, tree->gravity, x)));
    }
    return v;
}

/* The same from the first moments of what each joint carries, from the leaves inwards: operations in proportion to the
 * links. */
static kmp_ref potential_by_links(const kmp_tree *tree)
{
    kmp_graph *g = tree->graph;
    kmp_ref *mass = KMP_GRAPH_NEW(g, kmp_ref, tree->count);
    kmp_vec *moment = KMP_GRAPH_NEW(g, kmp_vec, tree->count);
    if (!mass || !moment)
        return KMP_ZERO;
    for (int i = 0; i < tree->count; i++)
        moment[i] = kmp_vec_zero();
    for (int i = tree->count - 1; i > 0; i--) {
        const kmp_link *link = &tree->links[i];
        mass[i] = kmp_add(g, mass[i], link->mass);
        kmp_vec own = kmp_vec_add(g, moment[i], kmp_vec_scale(g, link->mass, link->com));
        own = kmp_vec_add(g, own, kmp_vec_scale(g, mass[i], kmp_link_slide(tree, i)));
        own = kmp_vec_add(g, kmp_link_to_parent(tree, i, own), kmp_vec_scale(g, mass[i], link->p));
        mass[link->parent] = kmp_add(g, mass[link->parent], mass[i]);
        moment[link->parent] = kmp_vec_add(g, moment[link->parent], own);
    }
    return kmp_neg(kmp_vec_dot(g, tree->gravity, moment[0]));
}

/* -K q - D qd of a flexible body. */
static void add_elastic(kmp_forces *forces, const kmp_tree *tree, const kmp_deformation *d, unsigned energy)
{
    kmp_graph *g = tree->graph;
    for (int k = 0; k < d->count; k++) {
        kmp_ref pull = KMP_ZERO, drag = KMP_ZERO;
        const kmp_ref q = kmp_input(g, KMP_IN_Q, (uint32_t)(d->first + k));
        const kmp_ref qd = kmp_input(g, KMP_IN_QD, (uint32_t)(d->first + k));
        for (int l = 0; l < d->count; l++) {
            const uint32_t of = (uint32_t)(d->first + l);
            pull = kmp_add(g, pull, kmp_mul(g, d->stiffness[k * d->count + l], kmp_input(g, KMP_IN_Q, of)));
            drag = kmp_add(g, drag, kmp_mul(g, d->damping[k * d->count + l], kmp_input(g, KMP_IN_QD, of)));
        }
        kmp_apply_effort(forces, tree, d->first + k, kmp_neg(kmp_add(g, pull, drag)));
        if (energy & KMP_ENERGY_POTENTIAL)
            forces->potential = kmp_add(g, forces->potential, kmp_mul(g, kmp_const(g, 0.5), kmp_mul(g, pull, q)));
        if (energy & KMP_ENERGY_POWER)
            kmp_add_power(forces, tree, kmp_neg(drag), qd);
    }
}

void kmp_forces_init(kmp_forces *forces, const kmp_tree *tree, unsigned energy, const kmp_force *alone)
{
    const kempe_model *model = tree->model;
    kmp_tree kinked = *tree;
    kinked.conditions.kinks = kinked.conditions.watches = true;
    *forces = (kmp_forces){.potential = KMP_ZERO, .power = KMP_ZERO};
    forces->applied = KMP_GRAPH_NEW(tree->graph, kmp_wrench, tree->count);
    forces->effort = KMP_GRAPH_NEW(tree->graph, kmp_ref, kmp_model_motion_count(model) + 1);
    forces->value = KMP_GRAPH_NEW(tree->graph, kmp_ref, KMP_FORCE_WIDTH * kmp_model_force_count(model));
    for (int k = 0; !kmp_graph_failed(tree->graph) && k < kmp_model_force_count(model); k++)
        if (!alone || alone == kmp_model_force(model, k)) {
            const kmp_force *force = kmp_model_force(model, k);
            law_of(force->kind)(forces, &kinked, force, energy, forces->value + (ptrdiff_t)KMP_FORCE_WIDTH * k);
        }
    for (int i = 1; !alone && !kmp_graph_failed(tree->graph) && i < tree->count; i++)
        if (tree->links[i].deformation)
            add_elastic(forces, tree, tree->links[i].deformation, energy);
    if (energy & KMP_ENERGY_POTENTIAL)
        forces->potential =
            kmp_add(tree->graph, forces->potential,
                    energy & KMP_ENERGY_BY_LINKS ? potential_by_links(tree) : potential_of_gravity(tree));
}
