/* SPDX-License-Identifier: BSD-3-Clause */
/* Conditions and forces of elements with modes: dry friction and rigid contacts. Every quantity that a run decides by
 * (rate, level, place, reserve, distance) is a condition of one role, kmp_role, so that decisions read numbers and know
 * no laws. Slip of two directions is judged by its rate, or by the direction of its acceleration where it begins. */
#include "dynamics/kinematics/friction_modes.h"
#include "base/text.h"
#include "dynamics/kinematics/kinematics_conditions.h"
#include "dynamics/kinematics/kinematics_numbers.h"
#include "dynamics/kinematics/kinematics_vectors.h"
#include "dynamics/kinematics/link_tree.h"
#include "dynamics/kinematics/touching.h"
#include "model/data/model.h"
#include "symbolic/derivative.h"
#include "symbolic/function_table.h"

int kmp_friction_find(const kmp_tree *tree, const kmp_force *force)
{
    int first = tree->conditions.events ? kmp_events_find(tree->conditions.events, force, KMP_ROLE_SENSE) : -1;
    if (first >= 0 || !tree->conditions.events || tree->conditions.settled)
        return first;
    first = tree->conditions.events->count;
    const int roles = kmp_force_has_sides(force) ? KMP_ROLE_END - KMP_ROLE_SENSE : KMP_ROLES_OF_ALL;
    for (int role = KMP_ROLE_SENSE; role < KMP_ROLE_SENSE + roles; role++) {
        kmp_text text = {0};
        kmp_text_printf(&text, "%s '%s'", force->kind == KMP_FORCE_TOUCH ? "contact" : "friction", force->name);
        const bool level = role >= KMP_ROLE_LEVEL && force->kind != KMP_FORCE_TOUCH;
        const kmp_condition condition = {.of = force,
                                         .number = role,
                                         .role = (kmp_role)role,
                                         .validity = level ? KMP_VALIDITY_LEVEL : KMP_VALIDITY_NONE,
                                         .text = kmp_text_take(&text)};
        if (kmp_events_add(tree->conditions.events, condition) < 0) {
            kmp_graph_fail(tree->graph);
            return -1;
        }
    }
    return first;
}

kmp_ref kmp_friction_input(const kmp_tree *tree, const kmp_force *force, kmp_role role)
{
    int first = kmp_friction_find(tree, force);
    return first < 0 ? KMP_ZERO : kmp_input(tree->graph, KMP_IN_MODE, (uint32_t)(first + (int)role - KMP_ROLE_SENSE));
}

static const kmp_contact_pair *touch_of(const kmp_tree *tree, const kmp_force *force)
{
    return &tree->model->forces[force->contact - 1].touch;
}

/* The way of the friction of a contact, and where it starts again; zero and false without a way. */
static bool find_way(const kmp_tree *tree, const kmp_force *force, kmp_ref *way, kmp_ref *turn)
{
    bool found = kmp_touching_way(tree, touch_of(tree, force), force->across, way, turn);
    *way = found ? *way : KMP_ZERO;
    return found;
}

bool kmp_friction_has_place(const kmp_tree *tree, const kmp_force *force)
{
    kmp_ref way = KMP_ZERO, turn;
    return force->contact == 0 || find_way(tree, force, &way, &turn);
}

kmp_ref kmp_friction_moved(const kmp_tree *tree, const kmp_force *force)
{
    kmp_graph *g = tree->graph;
    kmp_ref way = KMP_ZERO, turn = KMP_ZERO, place = kmp_friction_input(tree, force, KMP_ROLE_PLACE);
    if (force->contact == 0)
        return kmp_sub(g, kmp_friction_place(tree, force), place);
    (void)find_way(tree, force, &way, &turn);
    kmp_ref moved = kmp_sub(g, way, place);
    if (turn == KMP_ZERO)
        return moved;
    /* less whole turns; its slope is the slope of the way wherever it was held, which rows of impacts need */
    const kmp_ref angle = kmp_div(g, moved, turn);
    return kmp_mul(g, turn, kmp_binary(g, KMP_OP_ATAN2, kmp_sin(g, angle), kmp_cos(g, angle)));
}

kmp_ref kmp_friction_place(const kmp_tree *tree, const kmp_force *force)
{
    kmp_ref way = KMP_ZERO, turn;
    if (force->contact > 0)
        return find_way(tree, force, &way, &turn) ? way : KMP_ZERO;
    return force->sliding ? kmp_tree_expression(tree, force->sliding)
                          : kmp_input(tree->graph, KMP_IN_Q, (uint32_t)force->motion);
}

kmp_ref kmp_friction_rate(const kmp_tree *tree, const kmp_force *force)
{
    if (!kmp_friction_is_along(force))
        return kmp_input(tree->graph, KMP_IN_QD, (uint32_t)force->motion);
    kmp_ref place = KMP_ZERO, turn;
    if (force->contact > 0 && !find_way(tree, force, &place, &turn))
        return kmp_touching_slip(tree, touch_of(tree, force), force->across);
    place = force->contact > 0 ? place : kmp_friction_place(tree, force);
    return kmp_vec_rate(tree, (kmp_vec){{place, KMP_ZERO, KMP_ZERO}}).x[0];
}

kmp_ref kmp_friction_own_rate(const kmp_tree *tree, const kmp_force *force)
{
    kmp_graph *g = tree->graph;
    kmp_derivative *by_time = force->sliding ? kmp_partial_time_derivative(tree) : NULL;
    kmp_ref place = force->sliding ? kmp_friction_place(tree, force) : KMP_ZERO, rate = KMP_ZERO, *slope;
    const kmp_ref drift = by_time ? kmp_derivative_of(by_time, place) : KMP_ZERO;
    int *motion;
    kmp_derivative_free(by_time);
    if (drift == KMP_ZERO)
        return kmp_friction_rate(tree, force);
    const int count = kmp_gradient(g, place, KMP_IN_Q, tree->model->motion_count, &motion, &slope);
    for (int i = 0; i < count; i++)
        rate = kmp_add(g, rate, kmp_mul(g, slope[i], kmp_input(g, KMP_IN_QD, (uint32_t)motion[i])));
    return rate;
}

kmp_input_kind kmp_friction_slopes_of(const kmp_tree *tree, const kmp_force *force, kmp_ref *of)
{
    kmp_ref turn;
    *of = KMP_ZERO;
    bool placed = force->contact == 0 || find_way(tree, force, of, &turn);
    if (force->contact == 0 || !placed)
        *of = placed ? kmp_friction_place(tree, force) : kmp_friction_rate(tree, force);
    return placed ? KMP_IN_Q : KMP_IN_QD;
}

/* A law, or its part against rates of one sign. Without a limit it has no value: zero. */
static kmp_ref side_of(const kmp_tree *tree, const kmp_expr *law, bool back)
{
    const kmp_expr *side = law->kind != KMP_EXPR_SIDES ? law : back ? law->b : law->a;
    return kmp_expr_is_unlimited(side) ? KMP_ZERO : kmp_tree_expression(tree, side);
}

/* The level in slip against positive rates, or against negative ones. */
static kmp_ref level_of(const kmp_tree *tree, const kmp_force *force, bool back)
{
    if (force->contact > 0)
        return kmp_mul(tree->graph, kmp_tree_number(tree, &force->level),
                       kmp_touch_push(tree, &tree->model->forces[force->contact - 1]));
    return force->effort ? side_of(tree, force->effort, back) : kmp_tree_number(tree, &force->level);
}

static kmp_ref level_ahead(const kmp_tree *tree, const kmp_force *force)
{
    return level_of(tree, force, false);
}

static kmp_ref level_back(const kmp_tree *tree, const kmp_force *force)
{
    return level_of(tree, force, true);
}

kmp_ref kmp_friction_level(const kmp_tree *tree, const kmp_force *force)
{
    const kmp_ref ahead = level_ahead(tree, force), back = level_back(tree, force);
    const int unlimited = kmp_force_unlimited(force); /* it does not slip in this direction */
    if (ahead == back || unlimited != 0)
        return unlimited > 0 ? back : ahead;
    return kmp_select(tree->graph, kmp_less(tree->graph, KMP_ZERO, kmp_friction_sense(tree, force)), ahead, back);
}

/* The static level, likewise. */
static kmp_ref static_level_of(const kmp_tree *tree, const kmp_force *force, bool back)
{
    if (!force->has_static)
        return level_of(tree, force, back);
    return force->holding_effort ? side_of(tree, force->holding_effort, back) : kmp_tree_number(tree, &force->holding);
}

static kmp_ref static_ahead(const kmp_tree *tree, const kmp_force *force)
{
    return static_level_of(tree, force, false);
}

static kmp_ref static_back(const kmp_tree *tree, const kmp_force *force)
{
    return static_level_of(tree, force, true);
}

static kmp_ref is_regularised(const kmp_tree *tree, const kmp_force *force)
{
    return kmp_less(tree->graph, KMP_ONE, kmp_friction_input(tree, force, KMP_ROLE_SENSE));
}

/* The size of two components. */
static kmp_ref size_of(kmp_graph *g, kmp_ref a, kmp_ref b)
{
    return kmp_sqrt(g, kmp_add(g, kmp_mul(g, a, a), kmp_mul(g, b, b)));
}

/* The square of the rates, or of the inputs of slip that begins, in both directions. */
static kmp_ref square_across(const kmp_tree *tree, const kmp_force *force, bool inputs)
{
    kmp_graph *g = tree->graph;
    const kmp_force *twin = kmp_friction_twin(force);
    kmp_ref a = inputs ? kmp_friction_input(tree, force, KMP_ROLE_RATE) : kmp_friction_rate(tree, force);
    kmp_ref b = inputs ? kmp_friction_input(tree, twin, KMP_ROLE_RATE) : kmp_friction_rate(tree, twin);
    return force->across == 1 ? kmp_add(g, kmp_mul(g, a, a), kmp_mul(g, b, b))
                              : kmp_add(g, kmp_mul(g, b, b), kmp_mul(g, a, a));
}

/* The rate by which the direction is judged. Slip that begins has no direction yet: its input w, a small rate along its
 * acceleration, is added, and fades as w |w|^2/(|w|^2 + |v|^2). */
static kmp_ref judged_rate(const kmp_tree *tree, const kmp_force *force)
{
    kmp_graph *g = tree->graph;
    kmp_ref ww = square_across(tree, force, true), begins = kmp_less(g, KMP_ZERO, ww);
    kmp_ref all = kmp_select(g, begins, kmp_add(g, ww, square_across(tree, force, false)), KMP_ONE);
    kmp_ref added = kmp_mul(g, kmp_friction_input(tree, force, KMP_ROLE_RATE), kmp_div(g, ww, all));
    return kmp_add(g, kmp_friction_rate(tree, force), added);
}

/* The amount of slip that is left: its rate, beyond a rate that counts as zero. For slip that begins: the distance to
 * the rate at which the beginning is over, or back from it. */
static kmp_ref slip_left(const kmp_tree *tree, const kmp_force *force)
{
    kmp_graph *g = tree->graph;
    const kmp_force *twin = kmp_friction_twin(force);
    kmp_ref ww = square_across(tree, force, true), begins = kmp_less(g, KMP_ZERO, ww);
    kmp_ref size = kmp_sqrt(g, square_across(tree, force, false));
    kmp_ref w = kmp_sqrt(g, kmp_select(g, begins, ww, KMP_ONE));
    kmp_ref first = kmp_mul(g, kmp_friction_rate(tree, force), kmp_friction_input(tree, force, KMP_ROLE_RATE));
    kmp_ref second = kmp_mul(g, kmp_friction_rate(tree, twin), kmp_friction_input(tree, twin, KMP_ROLE_RATE));
    kmp_ref along = kmp_div(g, kmp_add(g, first, second), w);
    kmp_ref ahead = kmp_sub(g, kmp_mul(g, kmp_const(g, KMP_FRICTION_BEGUN), w), size);
    kmp_ref back = kmp_add(g, along, kmp_mul(g, kmp_const(g, KMP_FRICTION_BACK), w));
    kmp_ref none = kmp_friction_input(tree, force, KMP_ROLE_PLACE);
    return kmp_select(g, begins, kmp_binary(g, KMP_OP_MIN, ahead, back), kmp_sub(g, size, none));
}

kmp_ref kmp_friction_sense(const kmp_tree *tree, const kmp_force *force)
{
    kmp_graph *g = tree->graph;
    bool modes = kmp_friction_find(tree, force) >= 0;
    kmp_ref rate = kmp_friction_rate(tree, force);
    if (force->across > 0) {
        kmp_ref slips = kmp_friction_input(tree, force, KMP_ROLE_SENSE);
        if (!modes)
            slips = kmp_unary(g, KMP_OP_ABS, rate);
        /* A component of the direction of slip while it slips, otherwise zero. */
        kmp_ref own = judged_rate(tree, force), other = judged_rate(tree, kmp_friction_twin(force));
        kmp_ref size = kmp_select(g, slips, size_of(g, own, other), KMP_ONE);
        return kmp_select(g, slips, kmp_div(g, judged_rate(tree, force), size), KMP_ZERO);
    }
    if (modes) {
        /* Its input; of an element that is regularised v/sqrt(v^2 + s^2). */
        kmp_ref sense = kmp_friction_input(tree, force, KMP_ROLE_SENSE);
        if (!force->has_regularise)
            return sense;
        kmp_ref v = kmp_friction_rate(tree, force), s = kmp_tree_number(tree, &force->regularise);
        kmp_ref vv = kmp_mul(g, v, v), ss = kmp_mul(g, s, s), smooth = kmp_div(g, v, kmp_sqrt(g, kmp_add(g, vv, ss)));
        return kmp_select(g, is_regularised(tree, force), smooth, sense);
    }
    return kmp_sub(g, kmp_less(g, KMP_ZERO, rate), kmp_less(g, rate, KMP_ZERO));
}

/* The rate in the direction of slip; without one, what is left of the rate that counts as none. */
static kmp_ref rate_ahead(const kmp_tree *tree, const kmp_force *force)
{
    kmp_graph *g = tree->graph;
    if (force->across > 0) {
        /* Slip in two directions: its size, in the condition of the first component. At rest each component has its
         * own. */
        kmp_ref none = kmp_friction_input(tree, force, KMP_ROLE_PLACE);
        kmp_ref left = force->across == 1 ? slip_left(tree, force) : KMP_ONE;
        kmp_ref rests = kmp_sub(g, none, kmp_unary(g, KMP_OP_ABS, kmp_friction_rate(tree, force)));
        kmp_ref open = kmp_select(g, kmp_friction_input(tree, force, KMP_ROLE_SENSE), left, rests);
        return kmp_select(g, kmp_friction_input(tree, force, KMP_ROLE_HELD), KMP_ONE, open);
    }
    kmp_ref rate = kmp_friction_rate(tree, force), sense = kmp_friction_input(tree, force, KMP_ROLE_SENSE);
    kmp_ref none = kmp_friction_input(tree, force, KMP_ROLE_PLACE);
    kmp_ref slips = kmp_add(g, kmp_mul(g, sense, rate), none);
    kmp_ref rests = kmp_sub(g, none, kmp_unary(g, KMP_OP_ABS, rate));
    slips = force->has_regularise ? kmp_select(g, is_regularised(tree, force), rests, slips) : slips;
    return kmp_select(g, kmp_friction_input(tree, force, KMP_ROLE_HELD), KMP_ONE, kmp_select(g, sense, slips, rests));
}

kmp_ref kmp_friction_force(const kmp_tree *tree, const kmp_force *force)
{
    kmp_graph *g = tree->graph;
    kmp_ref slip = kmp_mul(g, kmp_friction_sense(tree, force), kmp_friction_level(tree, force));
    kmp_ref held =
        kmp_mul(g, kmp_friction_input(tree, force, KMP_ROLE_HELD), kmp_tree_multiplier(tree, force->closure, 0));
    return kmp_add(g, kmp_sub(g, kmp_friction_input(tree, force, KMP_ROLE_GIVEN), slip), held);
}

static kmp_ref acceleration(const kmp_tree *tree, const kmp_force *force)
{
    return kmp_vec_acceleration(tree, (kmp_vec){{kmp_friction_rate(tree, force), KMP_ZERO, KMP_ZERO}}).x[0];
}

/* The rest of a multiple of the static levels beyond a force. */
static kmp_ref rest_of(const kmp_tree *tree, const kmp_force *force, kmp_ref multiple, kmp_ref f)
{
    kmp_graph *g = tree->graph;
    const kmp_ref ahead = kmp_mul(g, multiple, static_ahead(tree, force)),
                  back = kmp_mul(g, multiple, static_back(tree, force));
    const int unlimited = kmp_force_unlimited(force);
    if (ahead == back && unlimited == 0)
        return kmp_sub(g, ahead, kmp_unary(g, KMP_OP_ABS, f));
    const kmp_ref down = kmp_add(g, ahead, f), up = kmp_sub(g, back, f);
    return unlimited > 0 ? up : unlimited < 0 ? down : kmp_binary(g, KMP_OP_MIN, up, down);
}

/* Rest of the static level of an element that is held, or keeps a given force, which a level may fall below.
 * If the given force is the level itself, rounding must not decide. */
static kmp_ref reserve(const kmp_tree *tree, const kmp_force *force)
{
    kmp_graph *g = tree->graph;
    if (force->across > 0) {
        /* Slip in two directions: the rest of the level beyond the size of both components, in the first one. */
        static const kmp_role at_rest[] = {KMP_ROLE_HELD, KMP_ROLE_GIVEN};
        const kmp_force *twin = kmp_friction_twin(force);
        kmp_ref left = KMP_ONE, most = kmp_friction_level(tree, force);
        kmp_ref own = kmp_friction_force(tree, force), other = kmp_friction_force(tree, twin);
        kmp_ref size = size_of(g, own, other);
        kmp_ref reserve = kmp_sub(g, most, size);
        kmp_ref keeps = kmp_sub(g, kmp_mul(g, kmp_const(g, 1 + KMP_FRICTION_SLACK), most), size);
        for (int k = 1; k >= 0 && force->across == 1; k--) {
            left = kmp_select(g, kmp_friction_input(tree, force, at_rest[k]), k ? keeps : reserve, left);
            left = kmp_select(g, kmp_friction_input(tree, twin, at_rest[k]), k ? keeps : reserve, left);
        }
        return left;
    }
    const kmp_ref given = kmp_friction_input(tree, force, KMP_ROLE_GIVEN), slack = kmp_const(g, 1 + KMP_FRICTION_SLACK);
    const kmp_ref held = rest_of(tree, force, KMP_ONE, kmp_tree_multiplier(tree, force->closure, 0));
    const kmp_ref keeps = rest_of(tree, force, slack, given);
    return kmp_select(g, kmp_friction_input(tree, force, KMP_ROLE_HELD), held, kmp_select(g, given, keeps, KMP_ONE));
}

/* -- rigid contacts ------------------------------------------------------------------------------------ */

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

kmp_ref kmp_modes_force(const kmp_tree *tree, const kmp_force *force)
{
    return force->kind == KMP_FORCE_TOUCH ? kmp_touch_push(tree, force) : kmp_friction_force(tree, force);
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
    const kmp_force *friction = contact->rubbing > 0 ? &tree->model->forces[contact->rubbing - 1] : NULL;
    return friction && kmp_force_sticks(friction) ? kmp_tree_number(tree, &friction->level) : KMP_ZERO;
}

static kmp_ref touch_value(const kmp_tree *tree, const kmp_condition *condition)
{
    static kmp_ref (*const values[KMP_ROLE_END])(const kmp_tree *, const kmp_force *) = {
        [KMP_ROLE_SENSE] = distance_left,  [KMP_ROLE_HELD] = load_left, [KMP_ROLE_PLACE] = gap_of,
        [KMP_ROLE_GIVEN] = kmp_touch_push, [KMP_ROLE_RATE] = rate_of,   [KMP_ROLE_ACCELERATION] = acceleration_of,
        [KMP_ROLE_LEVEL] = restitution_of, [KMP_ROLE_STATIC] = ratio_of};
    return values[condition->role](tree, condition->of);
}

kmp_ref kmp_friction_value(const kmp_tree *tree, const kmp_condition *condition)
{
    static kmp_ref (*const values[KMP_ROLE_END])(const kmp_tree *, const kmp_force *) = {
        [KMP_ROLE_SENSE] = rate_ahead,         [KMP_ROLE_HELD] = reserve,
        [KMP_ROLE_PLACE] = kmp_friction_place, [KMP_ROLE_GIVEN] = kmp_friction_force,
        [KMP_ROLE_RATE] = kmp_friction_rate,   [KMP_ROLE_ACCELERATION] = acceleration,
        [KMP_ROLE_LEVEL] = level_ahead,        [KMP_ROLE_STATIC] = static_ahead,
        [KMP_ROLE_LEVEL_BACK] = level_back,    [KMP_ROLE_STATIC_BACK] = static_back};
    const kmp_force *force = condition->of;
    return force->kind == KMP_FORCE_TOUCH ? touch_value(tree, condition) : values[condition->role](tree, force);
}
