/* SPDX-License-Identifier: BSD-3-Clause */
/* The wheel's middle plane meets the road in x, the contact point is its nearest point to the plane of the road, and r
 * the distance of the centre from it. With the axle e and the normal n of the road
 *
 *     x = e x n / |e x n|,   y = n x x,   r = h / |e x n|,   sin(gamma) = e.n
 *
 * where h is the distance of the centre from the plane. The vertical force is C rho + K rho', rho = R - r, never
 * negative. A height f(x) of the road gives the tangential plane under the centre: one point, for wavelengths above the
 * radius. The slips are velocities of the point at the effective radius R_e under the centre over V = sqrt(V_x^2 +
 * V_low^2):
 *
 *     kappa = (w.e R_e - V_x) / V,   tan(alpha) = V_sy / V
 *
 * or states that follow over relaxation lengths s: s kappa' = (w.e R_e - V_x) - V kappa. None of the forces has a
 * potential: all count as power. */
#include "road/tyre/tyre_contact.h"
#include "constraints/tolerances.h"
#include "dynamics/equations.h"
#include "dynamics/kinematics/kinematics_conditions.h"
#include "dynamics/kinematics/kinematics_numbers.h"
#include "dynamics/kinematics/kinematics_vectors.h"
#include "dynamics/kinematics/link_tree.h"
#include "model/data/model.h"
#include "model/data/state.h"
#include "model/data/tyre.h"
#include "model/language/expression_value.h"
#include "road/tyre/magic_formula.h"
#include "symbolic/function_table.h"
#include "symbolic/substitute.h"
#include "symbolic/table_function.h"

/* Numbers of kmp_tree_condition. */
enum {
    TOUCHES,
    PULLS,
    SLIDES,
    LOW,
    STEEP,
    BEYOND,
    BEYOND_KAPPA,
    BEYOND_ALPHA,
    BEYOND_GAMMA,
    SHORT,
    SHORT_ACROSS,
    FALLEN
};

/* A tyre over its road. Vectors are in the axes of the ground. */
typedef struct rolling {
    const kmp_tree *tree;
    const kmp_tyre *tyre;
    kmp_vec axis[3]; /* of the contact */
    kmp_vec axle;
    kmp_vec arm;               /* from the centre to the contact point */
    kmp_vec turn;              /* angular velocity of the wheel against the road */
    kmp_vec velocity;          /* of the centre against the road */
    kmp_ref radius, effective; /* without load; R_e */
    kmp_ref rho, gamma, slope;
    kmp_ref upright;        /* square of the cosine of gamma */
    kmp_ref holds;          /* 1 where it has a vertical force */
    kmp_ref load;           /* N */
    kmp_ref forwards;       /* V_x */
    kmp_ref speed;          /* V */
    kmp_ref slip[2];        /* velocities w.e R_e - V_x and V_sy */
    kmp_ref kappa, tangent; /* by the states where it has some */
    kmp_ref friction;       /* factor of the file, or coefficient */
} rolling;

/* Forces of a contact. */
typedef struct grip {
    kmp_ref force[3], moment[3]; /* along the axes of the contact, at its point */
    kmp_ref friction;            /* the coefficient */
} grip;

/* -- geometry ------------------------------------------------------------------------------------------ */

static bool is_kinked(const kmp_expr *e, const void *user)
{
    (void)user;
    if (e->kind == KMP_EXPR_TABLE)
        return e->table && e->table->table &&
               (e->table->table->method == KMP_TABLE_LINEAR || e->table->outside == KMP_OUTSIDE_HOLD);
    return e->kind == KMP_EXPR_CALL &&
           (e->function == KMP_FUNCTION_abs || e->function == KMP_FUNCTION_min || e->function == KMP_FUNCTION_max);
}

/* The height under the centre and its slope. It is derived by a leaf, which the place then replaces. At a kink
 * of the height its slope jumps, and so does the tangential force. Such a kink is a bend, as in a closure. */
static void find_height(const kmp_tree *tree, const kmp_force *force, kmp_ref x, kmp_ref *height, kmp_ref *slope)
{
    kmp_graph *g = tree->graph;
    kmp_ref leaf = kmp_input(g, KMP_IN_PLACE, 0), place[3] = {leaf, KMP_ZERO, KMP_ZERO};
    kmp_tree within = *tree;
    within.place = place;
    within.conditions.bends = kmp_expr_find(force->vector[0], is_kinked, NULL);
    kmp_ref over = kmp_tree_expression(&within, force->vector[0]);
    kmp_derivatives_by(g, leaf, 1, &over, slope);
    *slope = kmp_graph_replace(g, 1, &leaf, &x, *slope);
    place[0] = x;
    *height = kmp_tree_expression(&within, force->vector[0]);
}

/* Axes, arm, deflection and camber over the plane of the road. */
static void find_place(rolling *c, const kmp_road *road, const kmp_force *force)
{
    const kmp_tree *tree = c->tree;
    kmp_graph *g = tree->graph;
    kmp_vec own[3], of_road[3];
    kmp_point_axes(tree, c->tyre->point, 0, own);
    kmp_point_axes(tree, road->point, 0, of_road);
    c->axle = own[1];
    kmp_vec off = kmp_vec_sub(g, kmp_point_position(tree, c->tyre->point, 0), kmp_point_position(tree, road->point, 0));
    kmp_vec normal = of_road[road->normal];
    kmp_ref up = kmp_vec_dot(g, off, normal);
    if (force->vector[0]) {
        kmp_ref height = KMP_ZERO, slope = KMP_ZERO, x = kmp_vec_dot(g, off, of_road[road->along]);
        find_height(tree, force, x, &height, &slope);
        kmp_ref over = kmp_div(g, KMP_ONE, kmp_sqrt(g, kmp_add(g, KMP_ONE, kmp_mul(g, slope, slope))));
        kmp_vec leaning = kmp_vec_sub(g, normal, kmp_vec_scale(g, slope, of_road[road->along]));
        normal = kmp_vec_scale(g, over, leaning);
        c->slope = slope;
        up = kmp_mul(g, over, kmp_sub(g, up, height));
    }
    kmp_vec ahead = kmp_vec_cross(g, c->axle, normal);
    c->upright = kmp_vec_dot(g, ahead, ahead);
    kmp_ref upright = kmp_sqrt(g, c->upright);
    c->axis[0] = kmp_vec_scale(g, kmp_div(g, KMP_ONE, upright), ahead);
    c->axis[1] = kmp_vec_cross(g, normal, c->axis[0]);
    c->axis[2] = normal;
    kmp_ref loaded = kmp_div(g, up, upright);
    c->arm = kmp_vec_scale(g, kmp_neg(loaded), kmp_vec_cross(g, c->axis[0], c->axle));
    c->radius = kmp_tree_number(tree, &c->tyre->radius);
    c->rho = kmp_sub(g, c->radius, loaded);
    c->gamma = kmp_unary(g, KMP_OP_ASIN, kmp_vec_dot(g, c->axle, normal));
}

/* -- vertical force and slips ---------------------------------------------------------------------------- */

static void press(rolling *c)
{
    const kmp_tree *tree = c->tree;
    kmp_graph *g = tree->graph;
    const kmp_tyre *tyre = c->tyre;
    kmp_ref stiffness = kmp_tree_number(tree, &tyre->vertical_stiffness);
    kmp_ref damping = kmp_tree_number(tree, &tyre->vertical_damping);
    kmp_ref load = kmp_mul(g, stiffness, c->rho);
    const double lag = KMP_TYRE_LAG * tyre->radius.value;
    c->holds =
        kmp_tree_condition(tree, tyre, TOUCHES, kmp_neg(c->rho), lag, NULL, "tyre '%s' touches its road", tyre->name);
    if (damping != KMP_ZERO) {
        kmp_vec rate = kmp_vec_rate(tree, (kmp_vec){{c->rho, KMP_ZERO, KMP_ZERO}});
        load = kmp_add(g, load, kmp_mul(g, damping, rate.x[0]));
        kmp_ref pulls = kmp_tree_condition(tree, tyre, PULLS, kmp_select(g, c->holds, load, KMP_ONE), 0, NULL,
                                           "tyre '%s' has no vertical force", tyre->name);
        c->holds = kmp_select(g, pulls, KMP_ZERO, c->holds);
    }
    /* Without contact the equations of the slips have a load, whose forces are not used. */
    const double nominal = tyre->tir ? tyre->tir[KMP_TIR_FNOMIN] : tyre->vertical_stiffness.value * tyre->radius.value;
    c->load = kmp_select(g, c->holds, load, kmp_const(g, nominal));
    kmp_ref shorter = kmp_mul(g, kmp_const(g, 1.0 / 3), c->rho);
    const double *tir = tyre->tir;
    if (tir && (tir[KMP_TIR_DREFF] != 0 || tir[KMP_TIR_FREFF] != 0)) {
        kmp_ref usual = kmp_div(g, kmp_const(g, tir[KMP_TIR_FNOMIN]), stiffness), over = kmp_div(g, c->rho, usual);
        kmp_ref bent = kmp_unary(g, KMP_OP_ATAN, kmp_mul(g, kmp_const(g, tir[KMP_TIR_BREFF]), over));
        shorter = kmp_mul(g, usual,
                          kmp_add(g, kmp_mul(g, kmp_const(g, tir[KMP_TIR_DREFF]), bent),
                                  kmp_mul(g, kmp_const(g, tir[KMP_TIR_FREFF]), over)));
    }
    c->effective = kmp_select(g, c->holds, kmp_sub(g, c->radius, shorter), c->radius);
}

static void find_velocities(rolling *c, const kmp_road *road)
{
    const kmp_tree *tree = c->tree;
    kmp_graph *g = tree->graph;
    const int link = kmp_point_link(tree, road->point);
    kmp_vec centre = kmp_point_position(tree, c->tyre->point, 0);
    c->velocity = kmp_vec_rate(tree, centre);
    c->turn = kmp_link_spin(tree, kmp_point_link(tree, c->tyre->point), 0);
    if (link > 0) {
        kmp_vec base = kmp_point_position(tree, road->point, 0), spin = kmp_link_spin(tree, link, 0);
        kmp_vec moved = kmp_vec_cross(g, spin, kmp_vec_sub(g, centre, base));
        c->velocity = kmp_vec_sub(g, c->velocity, kmp_vec_add(g, kmp_vec_rate(tree, base), moved));
        c->turn = kmp_vec_sub(g, c->turn, spin);
    }
    kmp_ref low = kmp_tree_number(tree, &c->tyre->low_speed);
    c->forwards = kmp_vec_dot(g, c->velocity, c->axis[0]);
    c->speed = kmp_sqrt(g, kmp_add(g, kmp_mul(g, c->forwards, c->forwards), kmp_mul(g, low, low)));
    c->slip[0] = kmp_sub(g, kmp_mul(g, kmp_vec_dot(g, c->turn, c->axle), c->effective), c->forwards);
    c->slip[1] = kmp_vec_dot(g, kmp_vec_add(g, c->velocity, kmp_vec_cross(g, c->turn, c->arm)), c->axis[1]);
}

static kmp_ref state_of(const rolling *c, int k)
{
    const int first = kmp_model_coordinates(c->tree->model);
    return kmp_input(c->tree->graph, KMP_IN_QD, (uint32_t)(first + c->tyre->state + k));
}

/* In the air only the slips of a tyre need the directions of its contact. */
static void watch_lean(const rolling *c)
{
    kmp_graph *g = c->tree->graph;
    kmp_ref left = kmp_sub(g, c->upright, kmp_const(g, KMP_TYRE_LEANS_MOST * KMP_TYRE_LEANS_MOST));
    kmp_tree_end(c->tree, c->tyre, FALLEN, c->tyre->state >= 0 ? left : kmp_select(g, c->holds, left, KMP_ONE),
                 "its axle, the y axis of its point, must not be along the road's normal",
                 "tyre '%s' has fallen on its side", c->tyre->name);
}

static void roll(const kmp_tree *tree, const kmp_force *force, rolling *c)
{
    kmp_graph *g = tree->graph;
    const kmp_tyre *tyre = &tree->model->tyres[force->tyre];
    const kmp_road *road = &tree->model->roads[tyre->road];
    *c = (rolling){.tree = tree, .tyre = tyre, .slope = KMP_ZERO};
    find_place(c, road, force);
    press(c);
    watch_lean(c);
    find_velocities(c, road);
    c->friction = kmp_mul(g, kmp_tree_number(tree, &tyre->friction), kmp_tree_number(tree, &road->friction));
    c->kappa = tyre->state >= 0 ? state_of(c, 0) : kmp_div(g, c->slip[0], c->speed);
    c->tangent = tyre->state >= 0 ? state_of(c, 1) : kmp_div(g, c->slip[1], c->speed);
}

/* -- laws ------------------------------------------------------------------------------------------------ */

/* A brush with parabolic pressure: with s = (kappa, tan(alpha)), t = 2 c a^2/(3 mu F_z) and u = t |s|/|1 + kappa| the
 * force is mu F_z (3 u - 3 u^2 + u^3) against the slip, and mu F_z where u > 1, without a moment (Pacejka 2012, 3.2).
 */
static void brush(const rolling *c, grip *out)
{
    kmp_graph *g = c->tree->graph;
    const double floor = 1e-30; /* of the square of the slip, so that its size has a derivative */
    kmp_ref half = kmp_tree_number(c->tree, &c->tyre->half_length), three = kmp_const(g, 3);
    kmp_ref stiffness = kmp_mul(
        g, kmp_const(g, 2), kmp_mul(g, kmp_tree_number(c->tree, &c->tyre->tread_stiffness), kmp_mul(g, half, half)));
    kmp_ref most = kmp_mul(g, c->friction, c->load), rolls = kmp_add(g, KMP_ONE, c->kappa);
    kmp_ref square = kmp_add(g, kmp_mul(g, c->kappa, c->kappa), kmp_mul(g, c->tangent, c->tangent));
    kmp_ref reach = kmp_div(g, kmp_mul(g, rolls, kmp_mul(g, three, most)), stiffness);
    kmp_ref slides = kmp_tree_condition(c->tree, c->tyre, SLIDES,
                                        kmp_select(g, c->holds, kmp_sub(g, kmp_mul(g, reach, reach), square), KMP_ONE),
                                        0, NULL, "tyre '%s' slides with its whole contact", c->tyre->name);
    kmp_ref size = kmp_sqrt(g, kmp_add(g, square, kmp_const(g, floor)));
    kmp_ref over = kmp_unary(g, KMP_OP_ABS, kmp_select(g, slides, KMP_ONE, reach));
    kmp_ref u = kmp_div(g, size, over), v = kmp_mul(g, u, u);
    kmp_ref part = kmp_add(g, kmp_sub(g, three, kmp_mul(g, three, u)), v);
    /* The force over the size of the slip. */
    kmp_ref each = kmp_mul(g, most, kmp_select(g, slides, kmp_div(g, KMP_ONE, size), kmp_div(g, part, over)));
    kmp_ref left = kmp_sub(g, KMP_ONE, u);
    kmp_ref trail = kmp_div(g, kmp_mul(g, half, kmp_power(g, left, 3)), part);
    out->force[0] = kmp_mul(g, each, c->kappa);
    out->force[1] = kmp_neg(kmp_mul(g, each, c->tangent));
    out->moment[0] = KMP_ZERO;
    kmp_ref resistance =
        kmp_mul(g, kmp_tree_number(c->tree, &c->tyre->rolling_resistance), kmp_mul(g, c->load, c->radius));
    out->moment[1] = kmp_neg(kmp_mul(g, resistance, kmp_div(g, c->forwards, c->speed)));
    out->moment[2] = kmp_select(g, slides, KMP_ZERO, kmp_neg(kmp_mul(g, trail, out->force[1])));
    out->friction = c->friction;
}

static kmp_magic_slip slip_of(const rolling *c)
{
    const bool turned = c->tyre->mirrored;
    return (kmp_magic_slip){.load = c->load,
                            .kappa = c->kappa,
                            .tangent = turned ? kmp_neg(c->tangent) : c->tangent,
                            .gamma = turned ? kmp_neg(c->gamma) : c->gamma,
                            .friction = c->friction,
                            .radius = c->radius,
                            .forwards = c->forwards,
                            .low_speed = kmp_tree_number(c->tree, &c->tyre->low_speed)};
}

static void magic(const rolling *c, grip *out)
{
    kmp_magic_force force;
    const bool turned = c->tyre->mirrored;
    const kmp_magic_slip slip = slip_of(c);
    kmp_magic_formula(c->tree->graph, c->tyre, &slip, &force);
    out->force[0] = force.along;
    out->force[1] = turned ? kmp_neg(force.across) : force.across;
    for (int k = 0; k < 3; k++)
        out->moment[k] = turned && k != 1 ? kmp_neg(force.moment[k]) : force.moment[k];
    out->friction = force.friction;
}

/* Forces at the contact; zero without contact. */
static void find_grip(const rolling *c, grip *out)
{
    kmp_graph *g = c->tree->graph;
    if (c->tyre->tir)
        magic(c, out);
    else
        brush(c, out);
    for (int k = 0; k < 2; k++)
        if (!c->tyre->along && !c->tyre->across)
            out->force[k] = out->moment[k] = out->moment[2] = KMP_ZERO;
    out->force[2] = c->load;
    for (int k = 0; k < 3; k++) {
        out->force[k] = kmp_select(g, c->holds, out->force[k], KMP_ZERO);
        out->moment[k] = kmp_select(g, c->holds, out->moment[k], KMP_ZERO);
    }
}

/* -- states of the slips ----------------------------------------------------------------------------------- */

/* A relaxation length, at least a fiftieth of the radius: lengths by a file vanish with the load. */
static kmp_ref at_least(const rolling *c, int number, kmp_ref length)
{
    kmp_graph *g = c->tree->graph;
    kmp_ref least = kmp_mul(g, kmp_const(g, 0.02), c->radius);
    kmp_ref is_short = kmp_tree_condition(c->tree, c->tyre, number, kmp_sub(g, length, least), 0, NULL,
                                          "tyre '%s' has its least relaxation length", c->tyre->name);
    return kmp_select(g, is_short, least, length);
}

static void relax(kmp_forces *forces, const rolling *c)
{
    kmp_graph *g = c->tree->graph;
    const kmp_tyre *tyre = c->tyre;
    kmp_ref length[2] = {KMP_ZERO, KMP_ZERO}, state[2] = {c->kappa, c->tangent};
    const bool given[2] = {tyre->has_longitudinal_relaxation, tyre->has_lateral_relaxation};
    const kmp_number *number[2] = {&tyre->longitudinal_relaxation, &tyre->lateral_relaxation};
    const kmp_magic_slip slip = slip_of(c);
    if (!given[0] || !given[1])
        kmp_magic_relaxation(g, tyre, &slip, length);
    for (int k = 0; k < 2; k++) {
        kmp_ref over = given[k] ? kmp_tree_number(c->tree, number[k]) : at_least(c, SHORT + k, length[k]);
        kmp_ref rate = kmp_div(g, kmp_sub(g, c->slip[k], kmp_mul(g, c->speed, state[k])), over);
        kmp_apply_effort(forces, c->tree, kmp_model_coordinates(c->tree->model) + tyre->state + k, rate);
    }
}

/* -- ranges ------------------------------------------------------------------------------------------------ */

/* Warns where `inside` is negative: a condition that changes nothing. */
static void watch(const rolling *c, int number, kmp_ref inside, const char *what)
{
    kmp_graph *g = c->tree->graph;
    (void)kmp_tree_condition(c->tree, c->tyre, number, kmp_select(g, c->holds, inside, KMP_ONE), 0, NULL,
                             "tyre '%s' %s", c->tyre->name, what);
    kmp_tree_warn_where_true(c->tree, c->tyre, number);
}

static void watch_range(const rolling *c, int number, kmp_ref value, int first, const char *what)
{
    kmp_graph *g = c->tree->graph;
    const double least = c->tyre->tir[first], most = c->tyre->tir[first + 1];
    if (!(least < most))
        return;
    kmp_ref above = kmp_sub(g, value, kmp_const(g, least)), below = kmp_sub(g, kmp_const(g, most), value);
    watch(c, number, kmp_binary(g, KMP_OP_MIN, above, below), what);
}

/* Height of a road: slopes of more than this are not meant for a single point. */
#define STEEPEST 0.3

static void watch_all(const rolling *c)
{
    kmp_graph *g = c->tree->graph;
    const double low = c->tyre->low_speed.value;
    if (c->tyre->along || c->tyre->across)
        watch(c, LOW, kmp_sub(g, kmp_mul(g, c->forwards, c->forwards), kmp_const(g, low * low)),
              "is below VXLOW, where its slips are damping");
    if (c->slope != KMP_ZERO)
        watch(c, STEEP, kmp_sub(g, kmp_const(g, STEEPEST * STEEPEST), kmp_mul(g, c->slope, c->slope)),
              "is on a slope above 0.3, too steep for a contact in one point");
    if (!c->tyre->tir)
        return;
    watch_range(c, BEYOND, c->load, KMP_TIR_FZMIN, "is outside FZMIN .. FZMAX of its file");
    watch_range(c, BEYOND_KAPPA, c->kappa, KMP_TIR_KPUMIN, "is outside KPUMIN .. KPUMAX of its file");
    watch_range(c, BEYOND_ALPHA, kmp_unary(g, KMP_OP_ATAN, c->tangent), KMP_TIR_ALPMIN,
                "is outside ALPMIN .. ALPMAX of its file");
    watch_range(c, BEYOND_GAMMA, c->gamma, KMP_TIR_CAMMIN, "is outside CAMMIN .. CAMMAX of its file");
}

/* -- forces and outputs ------------------------------------------------------------------------------------ */

static void law(kmp_forces *forces, const kmp_tree *tree, const kmp_force *force, unsigned energy, kmp_ref *value)
{
    kmp_graph *g = tree->graph;
    rolling c;
    grip found;
    roll(tree, force, &c);
    find_grip(&c, &found);
    watch_all(&c);
    if (c.tyre->state >= 0)
        relax(forces, &c);
    const kmp_vec applied = kmp_vec_along(g, found.force, c.axis), moment = kmp_vec_along(g, found.moment, c.axis);
    const int road = tree->model->roads[c.tyre->road].point;
    const int point[2] = {c.tyre->point, road};
    kmp_apply_between(forces, tree, point, 0, applied);
    kmp_apply_moment(forces, tree, point[0], 0, kmp_vec_add(g, moment, kmp_vec_cross(g, c.arm, applied)));
    if (kmp_point_link(tree, road) > 0) {
        kmp_vec off = kmp_vec_sub(g, kmp_point_position(tree, point[0], 0), kmp_point_position(tree, road, 0));
        kmp_vec turning = kmp_vec_cross(g, kmp_vec_add(g, off, c.arm), applied);
        kmp_apply_moment(forces, tree, road, 0, kmp_vec_sub(g, kmp_vec_zero(), kmp_vec_add(g, moment, turning)));
    }
    for (int k = 0; k < 3; k++) {
        value[k] = found.force[k];
        value[3 + k] = found.moment[k];
    }
    if (energy & KMP_ENERGY_POWER) {
        kmp_vec velocity = kmp_vec_add(g, c.velocity, kmp_vec_cross(g, c.turn, c.arm));
        kmp_ref power = kmp_add(g, kmp_vec_dot(g, applied, velocity), kmp_vec_dot(g, moment, c.turn));
        forces->power = kmp_add(g, forces->power, power);
    }
}

const kmp_law_row kmp_tyre_laws[] = {{KMP_FORCE_TYRE, law, kmp_tyre_place}, {0}};

void kmp_tyre_place(const kmp_tree *tree, const kmp_force *force, kmp_vec *place, kmp_vec axes[3])
{
    const kmp_tyre *tyre = &tree->model->tyres[force->tyre];
    rolling c = {.tree = tree, .tyre = tyre, .slope = KMP_ZERO};
    find_place(&c, &tree->model->roads[tyre->road], force);
    *place = kmp_vec_add(tree->graph, kmp_point_position(tree, tyre->point, 0), c.arm);
    for (int k = 0; k < 3; k++)
        axes[k] = c.axis[k];
}

static void show_contact(kmp_equations *eq, const kmp_output *output)
{
    kmp_graph *g = eq->graph;
    const kempe_model *model = eq->model;
    rolling c;
    grip found;
    roll(&eq->tree, &model->forces[model->tyres[output->index].force], &c);
    find_grip(&c, &found);
    kmp_ref deflection = kmp_select(g, c.holds, c.rho, KMP_ZERO), angle = kmp_unary(g, KMP_OP_ATAN, c.tangent);
    const kmp_ref shown[KMP_TYRE_SHOWN] = {c.kappa, angle, c.gamma, deflection, c.effective, found.friction};
    for (int k = 0; k < KMP_TYRE_SHOWN; k++)
        eq->outputs.shown[eq->outputs.shown_count++] = shown[k];
}

const kmp_output_of_wing kmp_tyre_outputs[] = {{KMP_OUTPUT_TYRE_CONTACT, show_contact}, {0}};
