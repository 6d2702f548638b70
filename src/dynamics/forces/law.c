/* SPDX-License-Identifier: BSD-3-Clause */
/* The laws of the kinds of force that need no more than a paragraph: each adds its wrenches, efforts and energy. */
#include "dynamics/forces/law.h"
#include "dynamics/forces/forces.h"
#include "dynamics/kinematics/friction_modes.h"
#include "dynamics/kinematics/kinematics_numbers.h"
#include "dynamics/kinematics/kinematics_vectors.h"
#include "dynamics/kinematics/link_tree.h"
#include "dynamics/kinematics/touching.h"
#include "model/data/body.h"
#include "model/data/force.h"
#include "model/data/force_table.h"
#include "model/data/state.h"
#include "model/language/expression.h"
#include "model/language/expression_value.h"
#include "symbolic/derivative.h"
#include "symbolic/function_table.h"
#include <stdbool.h>

/* Spring-damper in a joint: effort -k (q - rest) - c qd, potential k (q - rest)^2 / 2, power -c qd^2. */
void kmp_law_joint_spring(kmp_forces *forces, const kmp_tree *tree, const kmp_force *force, unsigned energy,
                          kmp_ref *value)
{
    kmp_graph *g = tree->graph;
    kmp_ref q = kmp_input(g, KMP_IN_Q, (uint32_t)force->motion), qd = kmp_input(g, KMP_IN_QD, (uint32_t)force->motion);
    kmp_ref stretch = kmp_sub(g, q, kmp_tree_number(tree, &force->rest));
    kmp_ref pull = kmp_mul(g, kmp_tree_number(tree, &force->stiffness), stretch);
    kmp_ref drag = kmp_mul(g, kmp_tree_number(tree, &force->damping), qd);
    *value = kmp_neg(kmp_add(g, pull, drag));
    kmp_apply_effort(forces, tree, force->motion, *value);
    if (energy & KMP_ENERGY_POTENTIAL) {
        kmp_ref work = kmp_mul(g, kmp_const(g, 0.5), kmp_mul(g, pull, stretch));
        forces->potential = kmp_add(g, forces->potential, work);
    }
    if (energy & KMP_ENERGY_POWER)
        kmp_add_power(forces, tree, kmp_neg(drag), qd);
}

/* Smooth end stops. With x = q - upper (or lower - q) and the width w,
 *
 *     p(x) = (x + sqrt(x^2 + w^2)) / 2        x far beyond the stop, w^2 / (4 |x|) far before it
 *     p'   = p / sqrt(x^2 + w^2)              from 0 to 1
 *     push back = k p p' + c p'^2 xd          potential k p^2 / 2, power -c (p' xd)^2
 *
 * which is k x + c xd deep in the stop, k w / 4 + c xd / 4 on it, and falls as k w^4 / (16 |x|^3) before it. All
 * derivatives exist everywhere. */

/* The effort of one end. */
static kmp_ref stop(kmp_forces *forces, const kmp_tree *tree, const kmp_force *force, const kmp_number *end, bool upper,
                    unsigned energy)
{
    kmp_graph *g = tree->graph;
    kmp_ref half = kmp_const(g, 0.5), w = kmp_tree_number(tree, &force->width);
    kmp_ref k = kmp_tree_number(tree, &force->stiffness), c = kmp_tree_number(tree, &force->damping);
    kmp_ref x = kmp_sub(g, kmp_input(g, KMP_IN_Q, (uint32_t)force->motion), kmp_tree_number(tree, end));
    kmp_ref xd = kmp_input(g, KMP_IN_QD, (uint32_t)force->motion);
    if (!upper) {
        x = kmp_neg(x);
        xd = kmp_neg(xd);
    }
    kmp_ref root = kmp_sqrt(g, kmp_add(g, kmp_mul(g, x, x), kmp_mul(g, w, w)));
    kmp_ref p = kmp_mul(g, half, kmp_add(g, x, root)), slope = kmp_div(g, p, root);
    kmp_ref kp = kmp_mul(g, k, p), drag = kmp_mul(g, c, kmp_mul(g, kmp_mul(g, slope, slope), xd));
    kmp_ref push = kmp_add(g, kmp_mul(g, kp, slope), drag);
    if (energy & KMP_ENERGY_POTENTIAL)
        forces->potential = kmp_add(g, forces->potential, kmp_mul(g, half, kmp_mul(g, kp, p)));
    if (energy & KMP_ENERGY_POWER)
        kmp_add_power(forces, tree, kmp_neg(drag), xd);
    return upper ? kmp_neg(push) : push;
}

void kmp_law_stops(kmp_forces *forces, const kmp_tree *tree, const kmp_force *force, unsigned energy, kmp_ref *value)
{
    *value = KMP_ZERO;
    if (force->has_lower)
        *value = stop(forces, tree, force, &force->lower, false, energy);
    if (force->has_upper)
        *value = kmp_add(tree->graph, *value, stop(forces, tree, force, &force->upper, true, energy));
    kmp_apply_effort(forces, tree, force->motion, *value);
}

/* Dry friction in a joint. With a speed s it is regularised: effort -F qd / sqrt(qd^2 + s^2). It is the level F at
 * speeds far beyond s and viscous, -F/s qd, far below it. There is no sticking: a load below F creeps at about s load /
 * F. Otherwise it sticks (dynamics/kinematics/friction_modes.h): the effort here is the effort of slip, and in stick
 * the row of a closure has it. */

/* On the coordinate, or on all that the place, or the rate, depends on. */
static void apply_along(kmp_forces *forces, const kmp_tree *tree, const kmp_force *force, kmp_ref effort)
{
    kmp_ref of, *slope;
    int *motion;
    if (!kmp_friction_is_along(force)) {
        kmp_apply_effort(forces, tree, force->motion, effort);
        return;
    }
    const kmp_input_kind by = kmp_friction_slopes_of(tree, force, &of);
    const int count = kmp_gradient(tree->graph, of, by, kmp_model_motion_count(tree->model), &motion, &slope);
    for (int i = 0; i < count; i++)
        if (slope[i] != KMP_ZERO)
            kmp_apply_effort(forces, tree, motion[i], kmp_mul(tree->graph, slope[i], effort));
}

/* The value of the output is the multiplier of the element's row: a run puts the force of every mode there. If modes
 * are the only inputs of conditions, there is no run, and a derivative needs the force itself. */
static kmp_ref force_of_modes(const kmp_tree *tree, const kmp_force *force)
{
    return tree->conditions.settled || tree->friction_in_place ? kmp_modes_force(tree, force)
                                                               : kmp_tree_multiplier(tree, force->closure, 0);
}

/* The static level has no part in the effort, but its conditions are among the conditions of the law. */
static void stick_and_slip(kmp_forces *forces, const kmp_tree *tree, const kmp_force *force, unsigned energy,
                           kmp_ref *value)
{
    kmp_graph *g = tree->graph;
    kmp_ref slip = kmp_mul(g, kmp_friction_sense(tree, force), kmp_friction_level(tree, force));
    kmp_ref effort = kmp_sub(g, kmp_friction_input(tree, force, KMP_ROLE_GIVEN), slip);
    *value = force_of_modes(tree, force);
    (void)kmp_friction_value(tree, &(kmp_condition){.of = force, .role = KMP_ROLE_STATIC});
    apply_along(forces, tree, force, effort);
    if (energy & KMP_ENERGY_POWER)
        kmp_add_power(forces, tree, effort, kmp_friction_own_rate(tree, force));
}

void kmp_law_friction(kmp_forces *forces, const kmp_tree *tree, const kmp_force *force, unsigned energy, kmp_ref *value)
{
    kmp_graph *g = tree->graph;
    if (kmp_force_sticks(force)) {
        stick_and_slip(forces, tree, force, energy, value);
        return;
    }
    kmp_ref qd = kmp_friction_rate(tree, force), s = kmp_tree_number(tree, &force->speed);
    kmp_ref level = kmp_friction_level(tree, force);
    kmp_ref root = kmp_sqrt(g, kmp_add(g, kmp_mul(g, qd, qd), kmp_mul(g, s, s)));
    *value = kmp_neg(kmp_mul(g, level, kmp_div(g, qd, root)));
    apply_along(forces, tree, force, *value);
    if (energy & KMP_ENERGY_POWER)
        kmp_add_power(forces, tree, *value, kmp_friction_own_rate(tree, force));
}

/* An effort given as an expression. A constant one has a potential; any other counts its power. */
void kmp_law_effort(kmp_forces *forces, const kmp_tree *tree, const kmp_force *force, unsigned energy, kmp_ref *value)
{
    kmp_graph *g = tree->graph;
    kmp_ref effort = kmp_tree_expression(tree, force->effort);
    uint32_t k = (uint32_t)force->motion;
    *value = effort;
    kmp_apply_effort(forces, tree, force->motion, effort);
    bool conserves = kmp_expr_is_constant(force->effort);
    if (conserves && energy & KMP_ENERGY_POTENTIAL)
        forces->potential = kmp_sub(g, forces->potential, kmp_mul(g, effort, kmp_input(g, KMP_IN_Q, k)));
    if (!conserves && energy & KMP_ENERGY_POWER)
        kmp_add_power(forces, tree, effort, kmp_input(g, KMP_IN_QD, k));
}

/* An effort along an expression of coordinates and t: its virtual work is the effort times the expression's. */
void kmp_law_along(kmp_forces *forces, const kmp_tree *tree, const kmp_force *force, unsigned energy, kmp_ref *value)
{
    *value = kmp_tree_expression(tree, force->effort);
    apply_along(forces, tree, force, *value);
    if (energy & KMP_ENERGY_POWER)
        kmp_add_power(forces, tree, *value, kmp_friction_own_rate(tree, force));
}

/* The rate of a state on the unit inertia of its motion. It has neither potential nor power. A delayed signal that the
 * caller sets has no rate. */
void kmp_law_state_rate(kmp_forces *forces, const kmp_tree *tree, const kmp_force *force, unsigned energy,
                        kmp_ref *value)
{
    const kmp_state *state = kmp_state_of(tree->model, force->motion);
    (void)energy;
    *value = tree->given_delays && state->delayed ? KMP_ZERO : kmp_tree_expression(tree, force->effort);
    kmp_apply_effort(forces, tree, force->motion, *value);
}

/* A force at a point, components in ground axes. A constant one has the potential -F.x, any other counts F.xd. */
void kmp_law_point_force(kmp_forces *forces, const kmp_tree *tree, const kmp_force *force, unsigned energy,
                         kmp_ref *value)
{
    kmp_vec f;
    *value = KMP_ZERO;
    for (int i = 0; i < 3; i++)
        f.x[i] = kmp_tree_expression(tree, force->vector[i]);
    kmp_apply_at(tree, force->point[0], 0, f, forces->applied);
    /* Potential of a constant force, power of any other. */
    kmp_graph *g = tree->graph;
    bool constant = true;
    for (int i = 0; i < 3; i++)
        constant = constant && kmp_expr_is_constant(force->vector[i]);
    if (!(energy & (constant ? KMP_ENERGY_POTENTIAL : KMP_ENERGY_POWER)))
        return;
    kmp_vec x = kmp_point_position(tree, force->point[0], 0);
    if (constant) {
        forces->potential = kmp_sub(g, forces->potential, kmp_vec_dot(g, f, x));
        return;
    }
    for (int i = 0; i < 3; i++)
        x.x[i] = f.x[i] == KMP_ZERO ? KMP_ZERO : x.x[i];
    x = kmp_vec_rate(tree, x);
    for (int i = 0; i < 3; i++)
        kmp_add_power(forces, tree, f.x[i], x.x[i]);
}

/* A torque on a body, components in ground axes. Its power is counted: a constant torque has no potential in space. */
void kmp_law_body_torque(kmp_forces *forces, const kmp_tree *tree, const kmp_force *force, unsigned energy,
                         kmp_ref *value)
{
    kmp_graph *g = tree->graph;
    int link = tree->mounts[force->body].link;
    kmp_vec torque;
    *value = KMP_ZERO;
    for (int i = 0; i < 3; i++)
        torque.x[i] = kmp_tree_expression(tree, force->vector[i]);
    kmp_wrench *applied = &forces->applied[link];
    applied->moment = kmp_vec_add(g, applied->moment, kmp_from_ancestor(tree, link, 0, torque));
    if (energy & KMP_ENERGY_POWER)
        forces->power = kmp_add(g, forces->power, kmp_vec_dot(g, torque, kmp_link_spin(tree, link, 0)));
}

/* The law of a spring and damper between two points, with the tension k (L - L0) + c Ld. With d from the first point to
 * the second and Ld = d.dd / L the force on the first point is (k - k L0 / L + c d.dd / L^2) d. Points at a constant
 * distance have a tension, too. */
void kmp_law_spring(kmp_forces *forces, const kmp_tree *tree, const kmp_force *force, unsigned energy, kmp_ref *value)
{
    kmp_graph *g = tree->graph;
    int frame;
    kmp_vec d = kmp_point_difference(tree, force->point[0], force->point[1], &frame);
    kmp_ref k = kmp_tree_number(tree, &force->stiffness), c = kmp_tree_number(tree, &force->damping);
    kmp_ref free_length = kmp_tree_number(tree, &force->free_length);
    kmp_ref square = kmp_vec_dot(g, d, d), length = kmp_sqrt(g, square), ratio;
    kmp_ref stretch = kmp_sub(g, length, free_length), tension = kmp_mul(g, k, stretch);
    ratio = kmp_sub(g, k, kmp_div(g, kmp_mul(g, k, free_length), length));
    if (c != KMP_ZERO) {
        kmp_ref rate = kmp_vec_dot(g, d, kmp_vec_rate(tree, d)); /* L Ld */
        kmp_ref damping = kmp_mul(g, c, kmp_div(g, rate, square));
        ratio = kmp_add(g, ratio, damping);
        if (rate != KMP_ZERO)
            tension = kmp_add(g, tension, kmp_mul(g, c, kmp_div(g, rate, length)));
        if (energy & KMP_ENERGY_POWER)
            forces->power = kmp_sub(g, forces->power, kmp_mul(g, damping, rate));
    }
    *value = tension;
    kmp_apply_between(forces, tree, force->point, frame, kmp_vec_scale(g, ratio, d));
    if (energy & KMP_ENERGY_POTENTIAL) {
        kmp_ref work = kmp_mul(g, kmp_mul(g, kmp_const(g, 0.5), k), kmp_mul(g, stretch, stretch));
        forces->potential = kmp_add(g, forces->potential, work);
    }
}

/* A force along the line between two points, by an expression of any quantities. With d from the first point to the
 * second and the tension T, the force on the first point is T d / |d|; its power is -T times the rate of |d|. A rope
 * runs through further points without friction: it has one tension, and the sum of its parts is its length. */
static void pull_along(kmp_forces *forces, const kmp_tree *tree, const kmp_force *force, kmp_ref tension, bool constant,
                       unsigned energy)
{
    kmp_graph *g = tree->graph;
    kmp_ref whole = KMP_ZERO, rate = KMP_ZERO;
    bool power = !constant && energy & KMP_ENERGY_POWER;
    for (int k = 0; k <= force->through_count; k++) {
        const int point[2] = {kmp_force_point(force, k), kmp_force_point(force, k + 1)};
        int frame;
        kmp_vec d = kmp_point_difference(tree, point[0], point[1], &frame);
        kmp_ref length = kmp_sqrt(g, kmp_vec_dot(g, d, d));
        kmp_apply_between(forces, tree, point, frame, kmp_vec_scale(g, kmp_div(g, tension, length), d));
        whole = kmp_add(g, whole, length);
        if (power)
            rate = kmp_add(g, rate, kmp_point_approach(tree, point[0], point[1]));
    }
    if (constant && energy & KMP_ENERGY_POTENTIAL)
        forces->potential = kmp_add(g, forces->potential, kmp_mul(g, tension, whole));
    if (power)
        kmp_add_power(forces, tree, kmp_neg(tension), rate);
}

void kmp_law_line(kmp_forces *forces, const kmp_tree *tree, const kmp_force *force, unsigned energy, kmp_ref *value)
{
    *value = kmp_tree_expression(tree, force->effort);
    pull_along(forces, tree, force, *value, kmp_expr_is_constant(force->effort), energy);
}

/* A hydraulic or pneumatic cylinder between two points. The pressure p on the whole piston (bore D) pushes the points
 * apart, the pressure r on the side of the rod (diameter d) pulls them together: thrust = pi/4 (p D^2 - r (D^2 - d^2)).
 */
void kmp_law_cylinder(kmp_forces *forces, const kmp_tree *tree, const kmp_force *force, unsigned energy, kmp_ref *value)
{
    kmp_graph *g = tree->graph;
    kmp_ref bore = kmp_tree_number(tree, &force->bore), rod = kmp_tree_number(tree, &force->rod);
    kmp_ref whole = kmp_mul(g, bore, bore), thrust;
    thrust = kmp_mul(g, whole, kmp_tree_expression(tree, force->vector[0]));
    bool constant = kmp_expr_is_constant(force->vector[0]);
    if (force->vector[1]) {
        kmp_ref ring = kmp_sub(g, whole, kmp_mul(g, rod, rod));
        thrust = kmp_sub(g, thrust, kmp_mul(g, ring, kmp_tree_expression(tree, force->vector[1])));
        constant = constant && kmp_expr_is_constant(force->vector[1]);
    }
    *value = kmp_mul(g, kmp_const(g, 0.78539816339744830962), thrust); /* pi/4 */
    pull_along(forces, tree, force, kmp_neg(*value), constant, energy);
}

/* A torque between two bodies about an axis w of the first point, by an expression of any quantities: T w on the first
 * body and -T w on the second, so that a positive T resists a growing angle, as a tension resists a growing distance.
 * Its power is -T times the component along w of the relative angular velocity. */
void kmp_law_torsion(kmp_forces *forces, const kmp_tree *tree, const kmp_force *force, unsigned energy, kmp_ref *value)
{
    kmp_graph *g = tree->graph;
    const int *point = force->point;
    const double e[3] = {force->axis == 0, force->axis == 1, force->axis == 2};
    int frame = kmp_tree_common(tree, kmp_point_link(tree, point[0]), kmp_point_link(tree, point[1]));
    *value = kmp_tree_expression(tree, force->effort);
    kmp_vec moment = kmp_vec_scale(g, *value, kmp_point_direction(tree, point[0], e, frame));
    kmp_apply_moment(forces, tree, point[0], frame, moment);
    kmp_apply_moment(forces, tree, point[1], frame, kmp_vec_sub(g, kmp_vec_zero(), moment));
    if (energy & KMP_ENERGY_POWER) {
        kmp_vec turning = kmp_point_measure(tree, KMP_MEASURE_ANGULAR_VELOCITY, point[1], point[0]);
        kmp_add_power(forces, tree, kmp_neg(*value), turning.x[force->axis]);
    }
}

/* A rigid contact. Its force is the multiplier of its row; where the rows of others keep it closed it is given, and
 * applied here. */
void kmp_law_touch(kmp_forces *forces, const kmp_tree *tree, const kmp_force *force, unsigned energy, kmp_ref *value)
{
    kmp_graph *g = tree->graph;
    kmp_ref given = kmp_friction_input(tree, force, KMP_ROLE_GIVEN), *slope;
    int *motion;
    value[0] = force_of_modes(tree, force);
    /* The place of its centre in the bearing. */
    kmp_ref square = KMP_ZERO;
    for (int k = 0; k < 3 && force->touch.clearance && force->vector[k]; k++) {
        kmp_ref x = kmp_tree_expression(tree, force->vector[k]);
        square = kmp_add(g, square, kmp_mul(g, x, x));
        if (k < 2)
            value[1 + k] = x;
    }
    if (force->touch.clearance)
        value[3] = kmp_sqrt(g, square);
    const int count = kmp_touching_slopes(tree, &force->touch, &motion, &slope);
    for (int i = 0; i < count; i++) {
        if (slope[i] == KMP_ZERO)
            continue;
        kmp_ref effort = kmp_mul(g, slope[i], given);
        kmp_apply_effort(forces, tree, motion[i], effort);
        if (energy & KMP_ENERGY_POWER)
            kmp_add_power(forces, tree, effort, kmp_input(g, KMP_IN_QD, (uint32_t)motion[i]));
    }
}
