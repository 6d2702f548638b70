/* SPDX-License-Identifier: BSD-3-Clause */
/* Numbers and expressions of the model as nodes of the graph. */
#include "dynamics/kinematics/kinematics_numbers.h"
#include "base/clones.h"
#include "dynamics/kinematics/bearing_forces.h"
#include "dynamics/kinematics/friction_modes.h"
#include "dynamics/kinematics/gear_mesh.h"
#include "dynamics/kinematics/kinematics_conditions.h"
#include "dynamics/kinematics/kinematics_vectors.h"
#include "dynamics/kinematics/link_tree.h"
#include "dynamics/kinematics/rope_path.h"
#include "dynamics/kinematics/touching.h"
#include "model/data/angle_sum.h"
#include "model/data/closure_table.h"
#include "model/data/model.h"
#include "model/data/variant.h"
#include "model/language/expression_value.h"
#include "symbolic/derivative.h"
#include "symbolic/function_table.h"
#include <math.h>
#include <stdlib.h>

/* -- measures ---------------------------------------------------------------------------------------- */

/* Positions, velocities, distances and angles of points and axes: the measures of expressions (model/expressions/
 * measures.def), and rates of expressions. */

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

static int compare_motions(const void *a, const void *b)
{
    int x = *(const int *)a, y = *(const int *)b;
    return (x > y) - (x < y);
}

/* Moves the factors of the rotations from a body to the ground out of the tree's room, into the list of their motions
 * and factors. */
static void take_factors(const kmp_tree *tree, int body, int *count, kmp_turn *turn)
{
    for (; body > 0; body = tree->model->bodies[body].parent) {
        const kmp_body *b = &tree->model->bodies[body];
        for (int k = b->first_motion; k < b->first_motion + b->motion_count; k++) {
            if (tree->factor[k] != 0)
                turn[(*count)++] = (kmp_turn){k, tree->factor[k]};
            tree->factor[k] = 0;
        }
    }
}

bool kmp_tree_angle_sum(const kmp_tree *tree, const kmp_measure_argument axis[3], bool at_rest, kmp_ref *sum)
{
    kmp_graph *g = tree->graph;
    double constant;
    int count = 0;
    const bool found = kmp_angle_sum(tree->model, axis, &constant, tree->factor);
    for (int i = 0; i < 3; i++)
        take_factors(tree, tree->model->points[axis[i].point].body, &count, tree->turn);
    if (!found)
        return false;
    if (count > 1)
        qsort(tree->turn, (size_t)count, sizeof *tree->turn, compare_motions);
    *sum = at_rest ? kmp_const(g, constant) : KMP_ZERO;
    for (int i = 0; i < count; i++) {
        kmp_ref q = kmp_input(g, KMP_IN_Q, (uint32_t)tree->turn[i].motion);
        *sum = kmp_add(g, *sum, kmp_mul(g, kmp_const(g, tree->turn[i].factor), q));
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
    if (measure->count == 3 && kmp_tree_angle_sum(tree, of, true, &sum))
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

/* A force or a moment of a closure or a joint. */
static kmp_vec load_of(const kmp_tree *tree, const kmp_measure *measure)
{
    const bool moment = measure->kind == KMP_MEASURE_MOMENT || measure->kind == KMP_MEASURE_JOINT_MOMENT;
    const bool joint = measure->kind == KMP_MEASURE_JOINT_REACTION || measure->kind == KMP_MEASURE_JOINT_MOMENT;
    const int of = measure->argument[0].closure;
    if (joint)
        return tree->reactions.joints ? tree->reactions.of_joint(tree, of, moment) : kmp_vec_zero();
    return tree->reactions.of_closure ? tree->reactions.of_closure(tree, of, moment) : kmp_vec_zero();
}

/* A component of a vector, or its size. */
static kmp_ref component(const kmp_tree *tree, kmp_vec v, int number)
{
    if (number < KMP_MEASURE_SIZE)
        return v.x[number];
    return kmp_sqrt(tree->graph, kmp_vec_dot(tree->graph, v, v));
}

KMP_NOINLINE static kmp_ref bearing_value(const kmp_tree *tree, const kmp_bearing_pair *pair, int number)
{
    kmp_ref values[KMP_BEARING_VALUES];
    kmp_bearing_reactions(tree, pair, values);
    if (number < KMP_BEARING_VALUES)
        return values[number];
    const kmp_ref *radial = values + 3 * (number - KMP_BEARING_VALUES);
    return component(tree, (kmp_vec){{radial[0], radial[1], radial[2]}}, KMP_MEASURE_SIZE);
}

/* A measure of expressions, component `number` of it. */
static kmp_ref tree_measure(const kmp_tree *tree, const kmp_measure *measure, int number)
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
    case KMP_MEASURE_PATH:
        return kmp_gear_path(tree, &tree->model->closures[of[0].closure], 0);
    case KMP_MEASURE_TRANSMISSION_ERROR:
        return kmp_gear_error(tree, &tree->model->closures[of[0].closure]);
    case KMP_MEASURE_LENGTH:
        return kmp_rope_length(tree, &tree->model->ropes[of[0].closure]);
    case KMP_MEASURE_FREE_LENGTH:
        return kmp_rope_free_length(tree, &tree->model->ropes[of[0].closure]);
    case KMP_MEASURE_WRAP:
        return kmp_rope_wrap(tree, &tree->model->ropes[of[0].closure], of[0].place);
    case KMP_MEASURE_SLIDE:
        return kmp_rope_slide(tree, &tree->model->ropes[of[0].closure], of[0].place);
    case KMP_MEASURE_DEPTH:
    case KMP_MEASURE_APPROACH:
    case KMP_MEASURE_NORMAL:
        return kmp_bearing_load_measure(tree, measure->kind, of[0].name);
    case KMP_MEASURE_REACTION:
    case KMP_MEASURE_MOMENT:
    case KMP_MEASURE_JOINT_REACTION:
    case KMP_MEASURE_JOINT_MOMENT:
        return component(tree, load_of(tree, measure), number);
    case KMP_MEASURE_BEARING:
        return bearing_value(tree, &tree->model->bearings[of[0].closure], number);
    default:
        return component(
            tree, kmp_point_measure(tree, measure->kind, of[0].point, measure->count > 1 ? of[1].point : -1), number);
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

/* The total time derivative of an expression of t and q. */
static kmp_ref tree_rate(const kmp_tree *tree, const kmp_expr *of)
{
    if (of->kind == KMP_EXPR_MEASURE && of->measure->kind == KMP_MEASURE_DISTANCE)
        return kmp_point_approach(tree, of->measure->argument[0].point, of->measure->argument[1].point);
    kmp_ref x = kmp_tree_expression(tree, of);
    kmp_derivative *d = kmp_time_derivative(tree);
    kmp_ref rate = kmp_derivative_of(d, x);
    kmp_derivative_free(d);
    return rate;
}

static kmp_ref call(kmp_graph *g, kmp_function f, kmp_ref a, kmp_ref b, kmp_ref c)
{
    (void)b, (void)c;
    switch (f) {
#define KMP_FUNCTION(name, arity, value, node)                                                                         \
    case KMP_FUNCTION_##name:                                                                                          \
        return node;
#include "model/language/functions.def"
#undef KMP_FUNCTION
    case KMP_FUNCTION_COUNT:
        break;
    }
    return KMP_ZERO;
}

/* True if an expression depends on parameters that can be kept as symbols. An exact zero stays a zero: the zero pattern
 * of the data is part of a program's identity. Numbers that shape the equations have the value read in all of them. */
static bool follows(const kempe_model *model, const kmp_expr *e)
{
    if (!e)
        return false;
    if (e->kind == KMP_EXPR_PARAMETER) {
        const kmp_parameter *p = &model->parameters[e->index];
        return !p->shapes && (p->number.value != 0 || follows(model, p->number.expr));
    }
    return follows(model, e->a) || follows(model, e->b) || follows(model, e->c);
}

/* A parameter's reference. A dependent parameter is not a separate symbol. A variable one has no value yet. */
KMP_NOINLINE static kmp_ref parameter(const kmp_tree *tree, int index)
{
    const kmp_parameter *p = &tree->model->parameters[index];
    if (p->varies)
        return kmp_input(tree->graph, KMP_IN_PARAMETER, (uint32_t)index);
    if (tree->keep == KMP_KEEP_NOTHING || p->shapes)
        return kmp_const(tree->graph, p->number.value);
    if (follows(tree->model, p->number.expr))
        return kmp_tree_expression(tree, p->number.expr);
    return p->number.value == 0 ? KMP_ZERO : kmp_input(tree->graph, KMP_IN_PARAMETER, (uint32_t)index);
}

KMP_NOINLINE static kmp_ref symbol(const kmp_tree *tree, int number, double value)
{
    int index = tree->model->parameter_count + number - 1;
    if (value == 0)
        return KMP_ZERO;
    tree->symbols[index] = value;
    return kmp_input(tree->graph, KMP_IN_PARAMETER, (uint32_t)index);
}

static double constant_value(const kmp_tree *tree, const kmp_expr *e);

kmp_ref kmp_tree_multiplier(const kmp_tree *tree, int closure, int component)
{
    int row = tree->reactions.row && component >= 0 ? tree->reactions.row[KMP_CLOSURE_ROWS * closure + component] : -1;
    return row < 0 ? KMP_ZERO : kmp_input(tree->graph, KMP_IN_LAMBDA, (uint32_t)row);
}

int kmp_tree_kept(const kmp_tree *tree, int closure, int k)
{
    for (int i = 0; tree->reactions.row && i < KMP_CLOSURE_ROWS; i++)
        if (tree->reactions.row[KMP_CLOSURE_ROWS * closure + i] >= 0 && k-- == 0)
            return i;
    return -1;
}

/* The force of a pin that closes a loop, across its axis. */
static void press_pin(const kmp_tree *tree, int c, kmp_ref force[3])
{
    const kempe_model *model = tree->model;
    const kmp_closure *closure = &model->closures[c];
    const int *point = closure->point;
    int frame = kmp_point_frame(tree, point[0], point[1]);
    int body = kmp_model_common_body(model, model->points[point[0]].body, model->points[point[1]].body);
    kmp_vec axis = kmp_point_direction(tree, point[0], closure->axis[0], frame);
    axis = kmp_body_vector_back(tree, body, axis);
    kmp_vec whole = {{force[0], force[1], force[2]}}, across = kmp_vec_cross(tree->graph, whole, axis);
    for (int k = 0; k < 3; k++)
        force[k] = across.x[k];
}

/* The size of the force of closures that presses surfaces together. */
KMP_NOINLINE static kmp_ref size_of_force(const kmp_tree *tree, const kmp_expr *e)
{
    kmp_graph *g = tree->graph;
    kmp_ref sum = KMP_ZERO, only = KMP_ZERO;
    int count = 0;
    for (int c = e->index; c < e->index - e->number; c++) {
        const kmp_closure *closure = &tree->model->closures[c];
        kmp_ref force[KMP_CLOSURE_ROWS] = {KMP_ZERO};
        const kmp_closure_row *row = kmp_closure_row_of(closure);
        int rows = row->pressing;
        for (int k = 0; k < rows; k++)
            force[k] = kmp_tree_multiplier(tree, c, k);
        if (row->needs == KMP_NEEDS_SAME_AXIS && rows == 3) /* a pin: without the part along its axis */
            press_pin(tree, c, force);
        for (int k = 0; k < rows; k++) {
            kmp_ref lambda = force[k];
            count += lambda != KMP_ZERO;
            only = lambda != KMP_ZERO ? lambda : only;
            sum = kmp_add(g, sum, kmp_mul(g, lambda, lambda));
        }
    }
    return count == 1 ? kmp_unary(g, KMP_OP_ABS, only) : kmp_sqrt(g, sum);
}

static bool is_function(const kmp_expr *e, kmp_function function)
{
    return e->kind == KMP_EXPR_CALL && e->function == function;
}

static bool is_kink(const kmp_expr *e)
{
    return is_function(e, KMP_FUNCTION_abs) || is_function(e, KMP_FUNCTION_min) || is_function(e, KMP_FUNCTION_max);
}

/* True if an expression is undefined somewhere. A fixed branch is evaluated beyond its kink for a part of a step, which
 * must not leave the domain. */
static bool has_limits(const kmp_expr *e)
{
    return e->kind == KMP_EXPR_DIV || is_function(e, KMP_FUNCTION_pow) || is_function(e, KMP_FUNCTION_sqrt) ||
           is_function(e, KMP_FUNCTION_log) || is_function(e, KMP_FUNCTION_asin) || is_function(e, KMP_FUNCTION_acos) ||
           is_function(e, KMP_FUNCTION_atan2);
}

static bool is_limit(const kmp_expr *e, double limit)
{
    return e && e->kind == KMP_EXPR_NUMBER && fabs(e->value) == limit;
}

/* True if a kink keeps the argument of a function within its domain, which ends at `limit` and its negative: beyond the
 * kink the function is undefined, and at it the rates do not jump. */
static bool is_kept_in(const kmp_expr *e, double limit)
{
    if (is_kink(e))
        return (is_function(e, KMP_FUNCTION_abs) && limit == 0) || is_limit(e->a, limit) || is_limit(e->b, limit);
    bool product = e->kind == KMP_EXPR_MUL || e->kind == KMP_EXPR_NEG;
    return product && (is_kept_in(e->a, limit) || (e->b && is_kept_in(e->b, limit)));
}

static bool keeps_in(const kmp_expr *e)
{
    bool by_one = is_function(e, KMP_FUNCTION_asin) || is_function(e, KMP_FUNCTION_acos);
    bool by_zero =
        is_function(e, KMP_FUNCTION_sqrt) || is_function(e, KMP_FUNCTION_log) || is_function(e, KMP_FUNCTION_pow);
    return (by_zero && is_kept_in(e->a, 0)) || (by_one && is_kept_in(e->a, 1));
}

/* An operand, within which kinks and bends may be no conditions. */
KMP_NOINLINE static kmp_ref without(const kmp_tree *tree, bool kinks, bool bends, const kmp_expr *e)
{
    kmp_tree within = *tree;
    within.conditions.kinks = kinks;
    within.conditions.bends = bends;
    return kmp_tree_expression(&within, e);
}

/* Most operations change nothing for their operands: in deep expressions the stack holds no copies of the tree. */
static kmp_ref operand(const kmp_tree *tree, bool kinks, bool bends, const kmp_expr *e)
{
    return kinks == tree->conditions.kinks && bends == tree->conditions.bends ? kmp_tree_expression(tree, e)
                                                                              : without(tree, kinks, bends, e);
}

KMP_NOINLINE static kmp_ref power(const kmp_tree *tree, const kmp_expr *e)
{
    kmp_graph *g = tree->graph;
    bool kept = tree->keep != KMP_KEEP_NOTHING && follows(tree->model, e->b);
    double exponent = kept || kmp_expr_varies(tree->model, e->b) ? NAN : constant_value(tree, e->b);
    bool whole = exponent >= 0 && exponent == floor(exponent);
    const bool kinks = tree->conditions.kinks && whole,
               bends = tree->conditions.bends && (whole || !is_kept_in(e->a, 0));
    kmp_ref base = operand(tree, kinks, bends, e->a);
    if (is_function(e->a, KMP_FUNCTION_tanh))
        kmp_tree_watch_pulse(tree, e->a, operand(tree, kinks, bends, e->a->a));
    if (tree->conditions.bends && exponent > 0 && !whole) {
        /* max(x, 0)^p of a closure: zero with all its derivatives where x is not positive, where the derivatives
         * of x^p are infinite. */
        const kmp_node *n = kmp_graph_node(g, kmp_id(base));
        const kmp_ref x = n->a == KMP_ZERO ? n->b : n->a;
        if (n->op != KMP_OP_MAX || kmp_is_negative(base) || (n->a != KMP_ZERO && n->b != KMP_ZERO))
            return kmp_power(g, base, exponent);
        const kmp_ref positive = kmp_less(g, KMP_ZERO, x);
        return kmp_select(g, positive, kmp_power(g, kmp_select(g, positive, x, KMP_ONE), exponent), KMP_ZERO);
    }
    return isnan(exponent) ? kmp_binary(g, KMP_OP_POW, base, operand(tree, kinks, bends, e->b))
                           : kmp_power(g, base, exponent);
}

static kmp_ref operation(const kmp_tree *tree, const kmp_expr *e)
{
    kmp_graph *g = tree->graph;
    /* Bounds take account of the kinks of compared expressions: they need not be conditions. */
    const bool compared = kmp_expr_compares(e, NULL);
    const bool kinks = tree->conditions.kinks && !compared && !has_limits(e);
    const bool bends = tree->conditions.bends && !compared && !keeps_in(e);
    kmp_ref a = e->kind == KMP_EXPR_DIV ? kmp_tree_expression(tree, e->a) : operand(tree, kinks, bends, e->a);
    kmp_ref b = e->b ? operand(tree, kinks, bends, e->b) : KMP_ZERO;
    switch (e->kind) {
    case KMP_EXPR_ADD:
        return kmp_add(g, a, b);
    case KMP_EXPR_SUB:
        return kmp_sub(g, a, b);
    case KMP_EXPR_MUL:
        return kmp_mul(g, a, b);
    case KMP_EXPR_LESS:
        return kmp_tree_stated(tree, e, a, b);
    case KMP_EXPR_GREATER:
        return kmp_tree_stated(tree, e, b, a);
    case KMP_EXPR_AT_MOST:
        return kmp_select(g, kmp_tree_stated(tree, e, b, a), KMP_ZERO, KMP_ONE);
    case KMP_EXPR_AT_LEAST:
        return kmp_select(g, kmp_tree_stated(tree, e, a, b), KMP_ZERO, KMP_ONE);
    case KMP_EXPR_CALL:
        if (e->function == KMP_FUNCTION_sign)
            return kmp_select(g, kmp_tree_stated(tree, e, a, KMP_ZERO), kmp_neg(KMP_ONE), KMP_ONE);
        if (is_kink(e))
            return kmp_tree_kink(tree, e, a, b);
        if (e->function != KMP_FUNCTION_tanh) /* of a step of the function both ends of a step of the run decide */
            kmp_tree_watch_pulse(tree, e, a);
        return call(g, e->function, a, b, e->c ? kmp_tree_expression(tree, e->c) : KMP_ZERO);
    default:
        return kmp_div(g, a, b);
    }
}

KMP_NOINLINE static kmp_ref table_of(const kmp_tree *tree, const kmp_expr *e)
{
    kmp_ref y = e->b ? kmp_tree_expression(tree, e->b) : KMP_ZERO, x = kmp_tree_expression(tree, e->a);
    return e->b ? kmp_tree_surface(tree, e, x, y) : kmp_tree_table(tree, e, x);
}

/* The multiplier of friction that sticks, and of a rigid contact, is its force in every mode: in laws by its mode; in
 * outputs runs put it among the multipliers. A level has only the forces of frictions
 * that are written before it: levels then never depend on each other in a circle. */
KMP_NOINLINE static kmp_ref multiplier(const kmp_tree *tree, int closure, int component)
{
    const kmp_closure *c = &tree->model->closures[closure];
    if (!kmp_closure_is_of_modes(c) || (tree->conditions.settled && !tree->friction_in_place))
        return kmp_tree_multiplier(tree, closure, component);
    return kmp_modes_force(tree, &tree->model->forces[c->force]);
}

kmp_ref kmp_tree_expression(const kmp_tree *tree, const kmp_expr *e)
{
    kmp_graph *g = tree->graph;
    /* A law that is one number. */
    if (e->symbol && tree->keep == KMP_KEEP_NUMBERS && !follows(tree->model, e))
        return symbol(tree, e->symbol, constant_value(tree, e));
    switch (e->kind) {
    case KMP_EXPR_NUMBER:
        return kmp_const(g, e->value);
    case KMP_EXPR_PARAMETER:
        return parameter(tree, e->index);
    case KMP_EXPR_TIME:
        return kmp_input(g, KMP_IN_TIME, 0);
    case KMP_EXPR_INPUT:
        if (tree->model->constants && tree->model->constants[e->index] > 0)
            return parameter(tree, tree->model->constants[e->index] - 1);
        return kmp_input(g, KMP_IN_TIME, kmp_time_index(e->index, 0));
    case KMP_EXPR_Q:
        return kmp_input(g, KMP_IN_Q, (uint32_t)e->index);
    case KMP_EXPR_QD:
        return kmp_input(g, KMP_IN_QD, (uint32_t)e->index);
    case KMP_EXPR_LAMBDA:
        if (e->measure)
            return tree_measure(tree, e->measure, e->number);
        return e->number < 0 ? size_of_force(tree, e)
                             : multiplier(tree, e->index, kmp_tree_kept(tree, e->index, e->number));
    case KMP_EXPR_UNKNOWN:
        return kmp_tree_unknown(tree, e);
    case KMP_EXPR_PLACE:
        return tree->place[e->index];
    case KMP_EXPR_TABLE:
        return table_of(tree, e);
    case KMP_EXPR_MEASURE:
        return tree_measure(tree, e->measure, e->number);
    case KMP_EXPR_RATE:
        return tree_rate(tree, e->a);
    case KMP_EXPR_CUT:
    case KMP_EXPR_SIDES: /* friction_modes.c takes one of them */
        return kmp_tree_expression(tree, e->a);
    case KMP_EXPR_NEG:
        return kmp_neg(kmp_tree_expression(tree, e->a));
    case KMP_EXPR_POW:
        return power(tree, e);
    default:
        return operation(tree, e);
    }
}

kmp_ref kmp_tree_bent(const kmp_tree *tree, const kmp_expr *e)
{
    kmp_tree bent = *tree;
    bent.conditions.bends = bent.conditions.watches = true;
    return kmp_tree_expression(&bent, e);
}

/* The value of an exponent, which is a number of the program for all parameters. */
KMP_NOINLINE static double constant_value(const kmp_tree *tree, const kmp_expr *e)
{
    kmp_tree folded = *tree;
    double value = NAN;
    folded.keep = KMP_KEEP_NOTHING;
    folded.names.value = NULL;
    kmp_ref r = kmp_tree_expression(&folded, e);
    return kmp_is_const(tree->graph, r, &value) ? value : NAN;
}

kmp_ref kmp_tree_number(const kmp_tree *tree, const kmp_number *number)
{
    const kmp_expr *e = number->expr;
    if (e && kmp_expr_varies(tree->model, e))
        return kmp_tree_expression(tree, e);
    if (tree->keep != KMP_KEEP_NOTHING && follows(tree->model, e))
        return kmp_tree_expression(tree, e);
    if (tree->keep != KMP_KEEP_NUMBERS || !number->symbol)
        return kmp_const(tree->graph, number->value);
    return symbol(tree, number->symbol, number->value);
}

int kmp_tree_symbol_count(const kmp_tree *tree)
{
    return tree->model->parameter_count + (tree->keep == KMP_KEEP_NUMBERS ? tree->model->symbol_count : 0);
}

void kmp_tree_symbol_values(const kmp_tree *tree, double *value)
{
    for (int k = 0; k < kmp_tree_symbol_count(tree); k++)
        value[k] = k < tree->model->parameter_count ? tree->model->parameters[k].number.value : tree->symbols[k];
}

kmp_vec kmp_tree_vector(const kmp_tree *tree, const kmp_number number[3])
{
    kmp_vec v;
    for (int k = 0; k < 3; k++)
        v.x[k] = kmp_tree_number(tree, &number[k]);
    return v;
}
