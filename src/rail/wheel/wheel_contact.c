/* SPDX-License-Identifier: BSD-3-Clause */
/* The normal force of an elastic contact is N = K d^1.5 (1 + c d'), d the penetration, K of Hertz or given. For a rigid
 * contact it is the multiplier of the wheel's closure. Creep forces follow from it by the wheel's law. */
#include "rail/wheel/wheel_contact.h"
#include "dynamics/kinematics/kinematics_numbers.h"
#include "dynamics/kinematics/link_tree.h"
#include "symbolic/function_table.h"

static kmp_touch touch_of(const kmp_tree *tree, const kmp_wheel *wheel, const kmp_patch *patch)
{
    return (kmp_touch){.along = patch->along,
                       .across = patch->across,
                       .shear_modulus = kmp_tree_number(tree, &wheel->shear_modulus),
                       .poisson = wheel->poisson};
}

/* 1 + c d', never negative: contact forces are compressive. */
static kmp_ref damping_of(const kmp_tree *tree, const kmp_wheel *wheel, const kmp_patch *patch)
{
    kmp_graph *g = tree->graph;
    kmp_ref damping = kmp_tree_number(tree, &wheel->damping);
    kmp_ref factor = kmp_sub(g, KMP_ONE, kmp_mul(g, damping, patch->closing));
    return damping == KMP_ZERO ? KMP_ONE : kmp_binary(g, KMP_OP_MAX, factor, KMP_ZERO);
}

static kmp_ref pressing(const kmp_tree *tree, const kmp_wheel *wheel, const kmp_patch *patch)
{
    kmp_graph *g = tree->graph;
    kmp_touch touch = touch_of(tree, wheel, patch);
    kmp_ref stiffness =
        wheel->has_stiffness ? kmp_tree_number(tree, &wheel->stiffness) : kmp_hertz_stiffness(g, &touch);
    kmp_ref force = kmp_mul(g, stiffness, kmp_power(g, kmp_neg(patch->gap), 1.5));
    force = kmp_mul(g, kmp_mul(g, patch->weight, damping_of(tree, wheel, patch)), force);
    return kmp_select(g, kmp_less(g, patch->gap, KMP_ZERO), force, KMP_ZERO);
}

static void creep(const kmp_tree *tree, const kmp_wheel *wheel, const kmp_wheel_pose *pose, kmp_contact *c)
{
    kmp_graph *g = tree->graph;
    c->creep = (kmp_creep_force){{KMP_ZERO, KMP_ZERO}, KMP_ZERO};
    if (wheel->law != KMP_CREEP_NONE) {
        const kmp_creep creep = {.touch = touch_of(tree, wheel, &c->patch),
                                 .normal = c->normal,
                                 .friction = kmp_tree_number(tree, &wheel->friction),
                                 .slip = {c->slip.along, c->slip.across},
                                 .spin = c->slip.spin};
        kmp_creep_law_force(g, wheel->law, &creep, &c->creep);
        c->creep.moment = kmp_mul(g, c->slip.sense, c->creep.moment); /* the law's axes turn with the rolling */
    }
    c->force = kmp_vec_add(g, kmp_vec_scale(g, c->creep.force[0], pose->axis[0]),
                           kmp_vec_scale(g, c->creep.force[1], c->patch.side));
    c->moment = kmp_vec_scale(g, c->creep.moment, c->patch.normal);
    c->pressed = kmp_vec_scale(g, c->normal, c->patch.normal);
}

void kmp_wheel_contact(const kmp_tree *tree, const kmp_wheel *wheel, const kmp_wheel_pose *pose, int k,
                       kmp_contact *contact)
{
    kmp_graph *g = tree->graph;
    bool rigid = wheel->form == KMP_CONTACT_RIGID;
    if (rigid)
        kmp_wheel_touch(tree, wheel, pose, &contact->patch);
    else
        kmp_wheel_patch(tree, wheel, k, pose, &contact->patch);
    kmp_wheel_slip(tree, wheel, pose, &contact->patch, &contact->slip);
    contact->lateral = kmp_add(g, contact->patch.y, pose->place.outwards[wheel->side]);
    contact->normal = rigid ? kmp_binary(g, KMP_OP_MAX, kmp_tree_multiplier(tree, wheel->closure, 0), KMP_ZERO)
                            : pressing(tree, wheel, &contact->patch);
    creep(tree, wheel, pose, contact);
}

void kmp_guidance_add(const kmp_tree *tree, const kmp_wheel_pose *pose, const kmp_contact *c, kmp_guidance *sum)
{
    kmp_graph *g = tree->graph;
    const kmp_vec force = kmp_vec_add(g, c->pressed, c->force);
    const kmp_ref along = kmp_mul(g, c->creep.force[0], c->slip.along),
                  across = kmp_mul(g, c->creep.force[1], c->slip.across);
    sum->load = kmp_add(g, sum->load, kmp_vec_dot(g, force, pose->axis[2]));
    sum->lateral = kmp_sub(g, sum->lateral, kmp_vec_dot(g, force, pose->axis[1]));
    sum->wear = kmp_add(g, sum->wear, kmp_add(g, kmp_unary(g, KMP_OP_ABS, along), kmp_unary(g, KMP_OP_ABS, across)));
}

void kmp_contact_values(const kmp_tree *tree, const kmp_wheel *wheel, const kmp_wheel_pose *pose, const kmp_contact *c,
                        kmp_ref *value)
{
    kmp_graph *g = tree->graph;
    kmp_touch touch = touch_of(tree, wheel, &c->patch);
    kmp_ref oval[3], pressed = kmp_less(g, KMP_ZERO, c->normal);
    kmp_hertz_axes(g, &touch, c->normal, oval);
    oval[2] = kmp_patch_fit(tree, wheel, pose, &c->patch);
    for (int k = 0; k < 3; k++)
        oval[k] = kmp_select(g, pressed, oval[k], KMP_ZERO);
    const kmp_ref shown[KMP_CONTACT_SHOWN] = {
        c->patch.s,      c->lateral,        kmp_unary(g, KMP_OP_ATAN, c->patch.slope),
        c->normal,       c->slip.along,     c->slip.across,
        c->slip.spin,    c->creep.force[0], c->creep.force[1],
        c->creep.moment, oval[0],           oval[1],
        oval[2]};
    for (int k = 0; k < KMP_CONTACT_SHOWN; k++)
        value[k] = shown[k];
}
