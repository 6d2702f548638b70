/* SPDX-License-Identifier: BSD-3-Clause */
/* Positions, velocities, distances and angles of points and axes: the measures of expressions (model/expressions/
 * measures.def), and rates of expressions. */
#include "dynamics/kinematics/kinematics_measures.h"
#include "dynamics/kinematics/kinematics_numbers.h"
#include "dynamics/kinematics/kinematics_vectors.h"
#include "dynamics/kinematics/link_tree.h"
#include "dynamics/kinematics/pressing.h"
#include "model/data/angle_sum.h"
#include "symbolic/derivative.h"
#include "symbolic/function_table.h"

/* -- vectors ------------------------------------------------------------------------------------------- */

/* A vector in the axes of link `link` along the axes of a point. */
static kmp_vec along_axes(const kmp_tree *tree, int point, int link, kmp_vec v)
{
    kmp_vec axes[3], out;
    kmp_point_axes(tree, point, link, axes);
    for (int k = 0; k < 3; k++)
        out.x[k] = kmp_vec_dot(tree->graph, axes[k], v);
    return out;
}

static kmp_vec position(const kmp_tree *tree, int point, int from)
{
    if (from < 0)
        return kmp_point_position(tree, point, 0);
    int frame;
    kmp_vec d = kmp_point_difference(tree, from, point, &frame);
    return along_axes(tree, from, frame, d);
}

static kmp_vec angular_velocity(const kmp_tree *tree, int point, int from)
{
    int link = kmp_point_link(tree, point);
    if (from < 0)
        return kmp_link_spin(tree, link, 0);
    int other = kmp_point_link(tree, from), frame = kmp_tree_common(tree, link, other);
    kmp_vec w = kmp_vec_sub(tree->graph, kmp_link_spin(tree, link, frame), kmp_link_spin(tree, other, frame));
    return along_axes(tree, from, frame, w);
}

kmp_vec kmp_point_measure(const kmp_tree *tree, kmp_measure_kind kind, int point, int from)
{
    switch (kind) {
    case KMP_MEASURE_POSITION:
        return position(tree, point, from);
    case KMP_MEASURE_VELOCITY:
        return kmp_vec_rate(tree, position(tree, point, from));
    case KMP_MEASURE_ANGULAR_VELOCITY:
        return angular_velocity(tree, point, from);
    case KMP_MEASURE_ACCELERATION:
        return kmp_vec_acceleration(tree, kmp_vec_rate(tree, position(tree, point, from)));
    case KMP_MEASURE_ANGULAR_ACCELERATION:
        return kmp_vec_acceleration(tree, angular_velocity(tree, point, from));
    default:
        return kmp_vec_zero();
    }
}

static kmp_vec axis_of(const kmp_tree *tree, const kmp_measure_argument *argument, int axis, int frame)
{
    double e[3] = {axis == 0, axis == 1, axis == 2};
    return kmp_point_direction(tree, argument->point, argument->along ? argument->along : e, frame);
}

/* -- numbers ------------------------------------------------------------------------------------------- */

static kmp_ref distance(const kmp_tree *tree, int a, int b)
{
    int frame;
    kmp_vec d = kmp_point_difference(tree, a, b, &frame);
    return kmp_sqrt(tree->graph, kmp_vec_dot(tree->graph, d, d));
}

/* An angle that is a sum of coordinates; false: it is none. */
static bool sum_of_angles(const kmp_tree *tree, const kmp_measure_argument axis[3], kmp_ref *sum)
{
    kmp_graph *g = tree->graph;
    double constant, *factor = KMP_GRAPH_NEW(g, double, tree->count);
    if (!factor || !kmp_angle_sum(tree->model, axis, &constant, factor))
        return false;
    *sum = kmp_const(g, constant);
    for (int k = 0; k < tree->count - 1; k++) {
        kmp_ref q = kmp_input(g, KMP_IN_Q, (uint32_t)k);
        if (factor[k] != 0)
            *sum = kmp_add(g, *sum, kmp_mul(g, kmp_const(g, factor[k]), q));
    }
    return true;
}

/* The angle between unit vectors u and v is atan2(|u x v|, u.v). That from u to v about w is the angle of their
 * components across w, atan2(w.(u x v), u.v - (w.u)(w.v)). */
static kmp_ref angle(const kmp_tree *tree, const kmp_measure *measure)
{
    kmp_graph *g = tree->graph;
    const kmp_measure_argument *of = measure->argument;
    kmp_ref sum;
    if (measure->count == 3 && sum_of_angles(tree, of, &sum))
        return sum;
    int frame = kmp_point_link(tree, of[0].point);
    for (int k = 1; k < measure->count; k++)
        frame = kmp_tree_common(tree, frame, kmp_point_link(tree, of[k].point));
    kmp_vec u = axis_of(tree, &of[0], of[0].axis, frame), v = axis_of(tree, &of[1], of[1].axis, frame);
    kmp_vec across = kmp_vec_cross(g, u, v);
    kmp_ref along = kmp_vec_dot(g, u, v);
    if (measure->count == 2)
        return kmp_binary(g, KMP_OP_ATAN2, kmp_sqrt(g, kmp_vec_dot(g, across, across)), along);
    kmp_vec w = axis_of(tree, &of[2], of[2].axis, frame);
    kmp_ref common = kmp_mul(g, kmp_vec_dot(g, w, u), kmp_vec_dot(g, w, v));
    return kmp_binary(g, KMP_OP_ATAN2, kmp_vec_dot(g, w, across), kmp_sub(g, along, common));
}

kmp_ref kmp_tree_measure(const kmp_tree *tree, const kmp_measure *measure, int number)
{
    const kmp_measure_argument *of = measure->argument;
    switch (measure->kind) {
    case KMP_MEASURE_DISTANCE:
        return distance(tree, of[0].point, of[1].point);
    case KMP_MEASURE_ANGLE:
        return angle(tree, measure);
    case KMP_MEASURE_AXES:
        /* Component `number` of the three axes of a point. */
        if (measure->count == 1)
            return axis_of(tree, of, number / 3, 0).x[number % 3];
        int frame = kmp_tree_common(tree, kmp_point_link(tree, of[0].point), kmp_point_link(tree, of[1].point));
        kmp_vec u = axis_of(tree, &of[0], number / 3, frame), v = axis_of(tree, &of[1], number % 3, frame);
        return kmp_vec_dot(tree->graph, u, v);
    case KMP_MEASURE_DEPTH:
    case KMP_MEASURE_APPROACH:
    case KMP_MEASURE_NORMAL:
        return kmp_bearing_load_measure(tree, measure->kind, of[0].name);
    case KMP_MEASURE_REACTION:
    case KMP_MEASURE_MOMENT:
        return tree->reaction ? tree->reaction(tree, of[0].closure, measure->kind == KMP_MEASURE_MOMENT).x[number]
                              : KMP_ZERO;
    case KMP_MEASURE_JOINT_REACTION:
    case KMP_MEASURE_JOINT_MOMENT:
        return tree->loads ? tree->carried(tree, of[0].closure, measure->kind == KMP_MEASURE_JOINT_MOMENT).x[number]
                           : KMP_ZERO;
    default:
        return kmp_point_measure(tree, measure->kind, of[0].point, measure->count > 1 ? of[1].point : -1).x[number];
    }
}

/* -- rates --------------------------------------------------------------------------------------------- */

/* d.d' / |d|: fewer operations than the derivative of the root. */
kmp_ref kmp_point_approach(const kmp_tree *tree, int a, int b)
{
    kmp_graph *g = tree->graph;
    int frame;
    kmp_vec d = kmp_point_difference(tree, a, b, &frame);
    kmp_ref across = kmp_vec_dot(g, d, kmp_vec_rate(tree, d));
    return kmp_div(g, across, kmp_sqrt(g, kmp_vec_dot(g, d, d)));
}

kmp_ref kmp_tree_rate(const kmp_tree *tree, const kmp_expr *of)
{
    if (of->kind == KMP_EXPR_MEASURE && of->measure->kind == KMP_MEASURE_DISTANCE)
        return kmp_point_approach(tree, of->measure->argument[0].point, of->measure->argument[1].point);
    kmp_ref x = kmp_tree_expression(tree, of);
    kmp_derivative *d = kmp_time_derivative(tree);
    kmp_ref rate = kmp_derivative_of(d, x);
    kmp_derivative_free(d);
    return rate;
}
