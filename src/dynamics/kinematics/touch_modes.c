/* SPDX-License-Identifier: BSD-3-Clause */
#include "dynamics/kinematics/touch_modes.h"
#include "dynamics/kinematics/touching.h"

static kmp_ref gap_of(const kmp_tree *tree, const kmp_force *contact)
{
    return kmp_touching_gap(tree, &contact->touch);
}

static kmp_ref rate_of(const kmp_tree *tree, const kmp_force *contact)
{
    return kmp_touching_rate(tree, &contact->touch);
}

static kmp_ref acceleration_of(const kmp_tree *tree, const kmp_force *contact)
{
    return kmp_vec_acceleration(tree, (kmp_vec){{rate_of(tree, contact), KMP_ZERO, KMP_ZERO}}).x[0];
}

kmp_ref kmp_touch_push(const kmp_tree *tree, const kmp_force *contact)
{
    kmp_graph *g = tree->graph;
    kmp_ref held =
        kmp_mul(g, kmp_friction_input(tree, contact, KMP_ROLE_HELD), kmp_tree_multiplier(tree, contact->closure, 0));
    return kmp_add(g, kmp_friction_input(tree, contact, KMP_ROLE_GIVEN), held);
}

/* For an open contact: its distance, raised by the distance that counts as zero. */
static kmp_ref distance_left(const kmp_tree *tree, const kmp_force *contact)
{
    kmp_graph *g = tree->graph;
    kmp_ref lifted = kmp_add(g, gap_of(tree, contact), kmp_friction_input(tree, contact, KMP_ROLE_PLACE));
    kmp_ref open = kmp_select(g, kmp_friction_input(tree, contact, KMP_ROLE_SENSE), lifted, KMP_ONE);
    return kmp_select(g, kmp_friction_input(tree, contact, KMP_ROLE_HELD), KMP_ONE, open);
}

static kmp_ref load_left(const kmp_tree *tree, const kmp_force *contact)
{
    return kmp_select(tree->graph, kmp_friction_input(tree, contact, KMP_ROLE_HELD),
                      kmp_tree_multiplier(tree, contact->closure, 0), KMP_ONE);
}

static kmp_ref restitution_of(const kmp_tree *tree, const kmp_force *contact)
{
    return kmp_tree_number(tree, &contact->restitution);
}

/* The coefficient of its friction; zero without. */
static kmp_ref ratio_of(const kmp_tree *tree, const kmp_force *contact)
{
    const kempe_model *model = tree->model;
    for (const kmp_force *f = model->forces; f < model->forces + model->force_count; f++)
        if (kmp_force_sticks(f) && f->contact > 0 && &model->forces[f->contact - 1] == contact)
            return kmp_tree_number(tree, &f->level);
    return KMP_ZERO;
}

kmp_ref kmp_touch_value(const kmp_tree *tree, const kmp_condition *condition)
{
    static kmp_ref (*const values[KMP_ROLE_END])(const kmp_tree *, const kmp_force *) = {
        [KMP_ROLE_SENSE] = distance_left,  [KMP_ROLE_HELD] = load_left, [KMP_ROLE_PLACE] = gap_of,
        [KMP_ROLE_GIVEN] = kmp_touch_push, [KMP_ROLE_RATE] = rate_of,   [KMP_ROLE_ACCELERATION] = acceleration_of,
        [KMP_ROLE_LEVEL] = restitution_of, [KMP_ROLE_STATIC] = ratio_of};
    return values[condition->role](tree, condition->of);
}
