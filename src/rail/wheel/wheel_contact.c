/* SPDX-License-Identifier: BSD-3-Clause */
/* The normal force of an elastic contact is N = K d^1.5 (1 + c d'), d the penetration, K of Hertz or given. For a rigid
 * contact it is the multiplier of the wheel's closure. Creep forces follow from it by the wheel's law. */
#include "rail/wheel/wheel_contact.h"
#include "dynamics/equations.h"
#include "dynamics/forces/forces.h"
#include "dynamics/kinematics/kinematics_conditions.h"
#include "dynamics/kinematics/kinematics_numbers.h"
#include "dynamics/kinematics/kinematics_vectors.h"
#include "dynamics/kinematics/link_tree.h"
#include "model/data/wheels.h"
#include "symbolic/function_table.h"
#include "symbolic/table_function.h"

typedef struct rail_contact {
    kmp_patch patch;
    kmp_slip slip;
    kmp_ref lateral; /* of the patch, outwards from the middle of the track, displacement of its rail included */
    kmp_ref normal;  /* N, along the normal */
    kmp_creep_force creep;
    kmp_vec force;   /* on the wheel at patch.point, N along the normal left out */
    kmp_vec moment;  /* with it */
    kmp_vec pressed; /* N along the normal */
} rail_contact;

/* Numbers of a wheel on its rail. */
typedef struct guidance {
    kmp_ref load, lateral; /* Q down, Y outwards in the plane of the track, N: forces on the rail */
    kmp_ref wear;          /* |along creep_along| + |across creep_across|, N: energy for each metre, without spin */
} guidance;

static kmp_touch touch_of(const kmp_tree *tree, const kmp_wheel *wheel, const kmp_patch *patch)
{
    return (kmp_touch){.along = patch->along,
                       .across = patch->across,
                       .shear_modulus = kmp_tree_number(tree, &wheel->shear_modulus),
                       .poisson = wheel->poisson};
}

static kmp_ref pressing(const kmp_tree *tree, const kmp_wheel *wheel, const kmp_patch *patch)
{
    kmp_graph *g = tree->graph;
    kmp_touch touch = touch_of(tree, wheel, patch);
    kmp_ref stiffness =
        wheel->has_stiffness ? kmp_tree_number(tree, &wheel->stiffness) : kmp_hertz_stiffness(g, &touch);
    kmp_ref force = kmp_mul(g, stiffness, kmp_power(g, kmp_neg(patch->gap), 1.5));
    /* 1 + c d', never negative: contact forces are compressive. */
    kmp_ref damping = kmp_tree_number(tree, &wheel->damping);
    kmp_ref factor = kmp_sub(g, KMP_ONE, kmp_mul(g, damping, patch->closing));
    factor = damping == KMP_ZERO ? KMP_ONE : kmp_binary(g, KMP_OP_MAX, factor, KMP_ZERO);
    force = kmp_mul(g, kmp_mul(g, patch->weight, factor), force);
    return kmp_select(g, kmp_less(g, patch->gap, KMP_ZERO), force, KMP_ZERO);
}

static void creep(const kmp_tree *tree, const kmp_wheel *wheel, const kmp_wheel_pose *pose, rail_contact *c)
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

/* Number k of its contacts (kmp_wheel_contacts). The graph fails when there is no memory. */
static void find_contact(const kmp_tree *tree, const kmp_wheel *wheel, const kmp_wheel_pose *pose, int k,
                         rail_contact *contact)
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

/* Adds a contact. */
static void guidance_add(const kmp_tree *tree, const kmp_wheel_pose *pose, const rail_contact *c, guidance *sum)
{
    kmp_graph *g = tree->graph;
    const kmp_vec force = kmp_vec_add(g, c->pressed, c->force);
    const kmp_ref along = kmp_mul(g, c->creep.force[0], c->slip.along),
                  across = kmp_mul(g, c->creep.force[1], c->slip.across);
    sum->load = kmp_add(g, sum->load, kmp_vec_dot(g, force, pose->axis[2]));
    sum->lateral = kmp_sub(g, sum->lateral, kmp_vec_dot(g, force, pose->axis[1]));
    sum->wear = kmp_add(g, sum->wear, kmp_add(g, kmp_unary(g, KMP_OP_ABS, along), kmp_unary(g, KMP_OP_ABS, across)));
}

/* The values of a contact that outputs show (KMP_CONTACT_SHOWN values; names in model/data/output_table.c): place on
 * wheel and track, angle, N, creepages and spin. Then forces along and across, moment, semi-axes of the patch and its
 * fit to one ellipse (kmp_patch_fit). */
static void contact_values(const kmp_tree *tree, const kmp_wheel *wheel, const kmp_wheel_pose *pose,
                           const rail_contact *c, kmp_ref *value)
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

/* -- forces ---------------------------------------------------------------------------------------------- */

/* A wheel on its rail. An elastic wheel has a normal force and a creep force in each zone; a rigid one has only the
 * creep force, which depends on the multiplier of the wheel's closure. None of these forces has a potential: all count
 * as power. An output shows the force on the wheel and its moment about the wheel's centre in the track's axes:
 * forwards, left, up.
 */

static void show(kmp_graph *g, const kmp_wheel_pose *pose, const rail_contact *c, kmp_vec arm, kmp_ref *value)
{
    kmp_vec force = kmp_vec_add(g, c->force, c->pressed);
    kmp_vec moment = kmp_vec_add(g, c->moment, kmp_vec_cross(g, arm, force));
    for (int k = 0; k < 3; k++) {
        value[k] = kmp_add(g, value[k], kmp_vec_dot(g, pose->place.axis[k], force));
        value[3 + k] = kmp_add(g, value[3 + k], kmp_vec_dot(g, pose->place.axis[k], moment));
    }
}

/* Cosine of the angle by which a wheel's axle may be turned out of the track's cross-section. */
#define MOST_TURNED 0.5

static void law(kmp_forces *forces, const kmp_tree *tree, const kmp_force *force, unsigned energy, kmp_ref *value)
{
    kmp_graph *g = tree->graph;
    const kmp_wheel *wheel = kmp_model_wheel(tree->model, force->wheel);
    bool rigid = wheel->form == KMP_CONTACT_RIGID;
    kmp_wheel_pose pose;
    kmp_wheel_find(tree, wheel, &pose);
    /* Conditions that end runs: the wheel has left its rail's cross-section, the wheel is turned out of its track, or a
     * rigid contact would need tension. */
    enum { OFF = KMP_WHEEL_ZONES, PULLED, TURNED, FAULT };
    const kmp_table *height = wheel->profile->height;
    kmp_ref under = kmp_sub(g, kmp_const(g, wheel->stands), pose.out);
    kmp_ref inner = kmp_sub(g, under, kmp_const(g, height->x[0]));
    kmp_ref outer = kmp_sub(g, kmp_const(g, height->x[height->count - 1]), under);
    kmp_tree_end(tree, wheel, OFF, kmp_binary(g, KMP_OP_MIN, inner, outer), "the contact point is outside its profile",
                 "wheel '%s' left its rail", wheel->name);
    const kmp_irregularities *all = &kmp_model_track(tree->model, wheel->track)->irregularities;
    for (int k = 0; k < KMP_IRREGULARITIES; k++)
        if (all->named[k])
            kmp_tree_watch_table(tree, wheel, FAULT + k, all->named[k], pose.place.along,
                                 "wheel '%s' at a point of table '%s'", wheel->name, all->named[k]->name);
    kmp_tree_end(tree, wheel, TURNED, kmp_sub(g, pose.axle[1], kmp_const(g, MOST_TURNED)),
                 "its axle, the y axis of its point, must point across the track to the left",
                 "wheel '%s' is not aligned with its rail", wheel->name);
    if (wheel->form == KMP_CONTACT_RIGID)
        kmp_tree_end(tree, wheel, PULLED, kmp_tree_multiplier(tree, wheel->closure, 0),
                     "the normal force of a rigid contact became tensile; with 'contact: elastic' the wheel lifts off",
                     "wheel '%s' is unloaded", wheel->name);
    for (int k = 0; k < kmp_wheel_contacts(wheel); k++) {
        rail_contact c;
        find_contact(tree, wheel, &pose, k, &c);
        kmp_vec arm = kmp_vec_sub(g, c.patch.point, pose.centre);
        kmp_vec applied = rigid ? c.force : kmp_vec_add(g, c.force, c.pressed);
        /* Applies to the wheel's link a force, at a place relative to the centre, and a moment, ground axes. */
        int point = wheel->point;
        kmp_vec moment = c.moment;
        int link = kmp_point_link(tree, point);
        kmp_vec turn = kmp_from_ancestor(tree, link, 0, kmp_vec_add(g, moment, kmp_vec_cross(g, arm, applied)));
        kmp_apply_at(tree, point, 0, applied, forces->applied);
        forces->applied[link].moment = kmp_vec_add(g, forces->applied[link].moment, turn);
        show(g, &pose, &c, arm, value);
        if (energy & KMP_ENERGY_POWER) {
            kmp_ref power = kmp_vec_dot(g, applied, c.slip.velocity);
            kmp_ref turning = kmp_vec_dot(g, c.moment, c.slip.turn);
            forces->power = kmp_add(g, forces->power, kmp_add(g, power, turning));
        }
    }
}

const kmp_law_row kmp_wheel_laws[] = {{KMP_FORCE_WHEEL, law, NULL}, {0}};

/* -- closures -------------------------------------------------------------------------------------------- */

/* A rigid wheel on a rigid rail: h is the gap along the normal at the closest points; lambda is the normal force. */

static void residual(const kmp_tree *tree, const kmp_closure *closure, kmp_ref *h)
{
    const kmp_wheel *wheel = kmp_model_wheel(tree->model, closure->wheel);
    kmp_wheel_pose pose;
    kmp_patch patch;
    kmp_wheel_find(tree, wheel, &pose);
    kmp_wheel_touch(tree, wheel, &pose, &patch);
    h[0] = patch.gap;
}

static const kmp_part part = {1, 1, residual, kmp_part_effort, NULL};

const kmp_closure_of_wing kmp_wheel_closures[] = {{KMP_CLOSURE_wheel, {&part, &kmp_part_none}}, {0}};

/* -- outputs --------------------------------------------------------------------------------------------- */

/* The values of each contact of a wheel, or the sums that guide it; Y/Q is zero where no load is. */
static void show_contacts(kmp_equations *eq, const kmp_output *output)
{
    const bool sums = output->kind == KMP_OUTPUT_GUIDANCE;
    const kmp_wheel *wheel = kmp_model_wheel(eq->model, output->index);
    kmp_graph *g = eq->graph;
    guidance sum = {KMP_ZERO, KMP_ZERO, KMP_ZERO};
    kmp_wheel_pose pose;
    kmp_wheel_find(&eq->tree, wheel, &pose);
    for (int k = 0; k < kmp_wheel_contacts(wheel); k++) {
        rail_contact contact;
        find_contact(&eq->tree, wheel, &pose, k, &contact);
        if (sums) {
            guidance_add(&eq->tree, &pose, &contact, &sum);
            continue;
        }
        contact_values(&eq->tree, wheel, &pose, &contact, eq->outputs.shown + eq->outputs.shown_count);
        eq->outputs.shown_count += KMP_CONTACT_SHOWN;
    }
    if (!sums)
        return;
    const kmp_ref loaded = kmp_less(g, KMP_ZERO, sum.load), load = kmp_select(g, loaded, sum.load, KMP_ONE);
    const kmp_ref shown[] = {sum.load, sum.lateral, kmp_select(g, loaded, kmp_div(g, sum.lateral, load), KMP_ZERO),
                             sum.wear};
    for (size_t k = 0; k < sizeof shown / sizeof *shown; k++)
        eq->outputs.shown[eq->outputs.shown_count++] = shown[k];
}

static void show_pose(kmp_equations *eq, const kmp_output *output)
{
    kmp_wheel_pose pose;
    kmp_wheel_find(&eq->tree, kmp_model_wheel(eq->model, output->index), &pose);
    const kmp_ref shown[KMP_POSE_SHOWN] = {pose.out, pose.up, pose.axle[0], pose.axle[1], pose.axle[2]};
    for (int k = 0; k < KMP_POSE_SHOWN; k++)
        eq->outputs.shown[eq->outputs.shown_count++] = shown[k];
}

const kmp_output_of_wing kmp_wheel_outputs[] = {
    {KMP_OUTPUT_CONTACT, show_contacts}, {KMP_OUTPUT_GUIDANCE, show_contacts}, {KMP_OUTPUT_POSE, show_pose}, {0}};
