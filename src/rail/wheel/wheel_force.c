/* SPDX-License-Identifier: BSD-3-Clause */
/* A wheel on its rail. An elastic wheel has a normal force and a creep force in each zone; a rigid one has the creep
 * force alone, which depends on the multiplier of the wheel's closure. None of these forces has a potential: all count
 * as power. An output shows the force on the wheel and its moment about the wheel's centre in the track's axes:
 * forwards, left, up.
 */
#include "rail/wheel/wheel_force.h"
#include "dynamics/forces/forces.h"
#include "dynamics/kinematics/kinematics_conditions.h"
#include "dynamics/kinematics/kinematics_numbers.h"
#include "dynamics/kinematics/kinematics_vectors.h"
#include "dynamics/kinematics/link_tree.h"
#include "model/data/model.h"
#include "rail/wheel/wheel_contact.h"
#include "symbolic/table_function.h"

static void show(kmp_graph *g, const kmp_wheel_pose *pose, const kmp_contact *c, kmp_vec arm, kmp_ref *value)
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
    const kmp_wheel *wheel = &tree->model->wheels[force->wheel];
    bool rigid = wheel->form == KMP_CONTACT_RIGID;
    kmp_wheel_pose pose;
    kmp_wheel_find(tree, wheel, &pose);
    /* Conditions that end runs: the wheel has left its rail's cross-section, the wheel is turned out of its track, or a
     * rigid contact would need tension. */
    enum { OFF = KMP_WHEEL_ZONES, PULLED, TURNED };
    const kmp_table *height = wheel->profile->height;
    kmp_ref under = kmp_sub(g, kmp_const(g, wheel->stands), pose.out);
    kmp_ref inner = kmp_sub(g, under, kmp_const(g, height->x[0]));
    kmp_ref outer = kmp_sub(g, kmp_const(g, height->x[height->count - 1]), under);
    kmp_tree_end(tree, wheel, OFF, kmp_binary(g, KMP_OP_MIN, inner, outer), "the contact point is outside its profile",
                 "wheel '%s' left its rail", wheel->name);
    kmp_tree_end(tree, wheel, TURNED, kmp_sub(g, pose.axle[1], kmp_const(g, MOST_TURNED)),
                 "its axle, the y axis of its point, must point across the track to the left",
                 "wheel '%s' is not aligned with its rail", wheel->name);
    if (wheel->form == KMP_CONTACT_RIGID)
        kmp_tree_end(tree, wheel, PULLED, kmp_tree_multiplier(tree, wheel->closure, 0),
                     "the normal force of a rigid contact became tensile; with 'contact: elastic' the wheel lifts off",
                     "wheel '%s' is unloaded", wheel->name);
    for (int k = 0; k < kmp_wheel_contacts(wheel); k++) {
        kmp_contact c;
        kmp_wheel_contact(tree, wheel, &pose, k, &c);
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

const kmp_law_row kmp_wheel_laws[] = {{KMP_FORCE_WHEEL, law}, {0}};
