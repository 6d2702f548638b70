/* SPDX-License-Identifier: BSD-3-Clause */
/* With d from the second side's point to the first's, n the normal and r the first side's radius: on a plane the gap is
 * n.d - r. About a sphere or an axis it is the distance from there less both radii, inside one the opposite. On a
 * profile moved outwards by r, y = f(x), it is (y - f)/sqrt(1 + f'^2), which is the distance where it is small and has
 * its derivatives on the curve. The middle circle of a cylinder with the axis e reaches r sqrt(1 - (n.e)^2) towards a
 * plane. */
#include "dynamics/kinematics/touching.h"
#include "dynamics/kinematics/cam_contact.h"
#include "dynamics/kinematics/kinematics_conditions.h"
#include "dynamics/kinematics/kinematics_numbers.h"
#include "dynamics/kinematics/kinematics_vectors.h"
#include "dynamics/kinematics/link_tree.h"
#include "dynamics/kinematics/outline_contact.h"
#include "model/data/angle_sum.h"
#include "model/data/model.h"
#include "model/data/outline.h"
#include "model/data/parallel_curve.h"
#include "symbolic/derivative.h"
#include "symbolic/function_table.h"
#include "symbolic/table_function.h"
#include <math.h>
#include <string.h>

/* The cosine of the angle to the equator of a sphere beyond which directions of slip change to the directions of the
 * pole there.
 */
#define LOWER_POLE 0.5

/* The sides being brought together: axes of both points, the vector d and the radii. */
typedef struct pair {
    const kmp_tree *tree;
    const kmp_contact_pair *touch;
    int frame;
    kmp_vec d, axes[2][3];
    kmp_ref radius[2];
} pair;

static pair pair_of(const kmp_tree *tree, const kmp_contact_pair *touch)
{
    pair p = {.tree = tree, .touch = touch};
    p.d = kmp_point_difference(tree, touch->side[1].point, touch->side[0].point, &p.frame);
    for (int k = 0; k < 2; k++) {
        kmp_point_axes(tree, touch->side[k].point, p.frame, p.axes[k]);
        p.radius[k] = kmp_tree_number(tree, &touch->radius[k]);
    }
    if (touch->side[0].off) {
        kmp_graph *g = tree->graph;
        for (int i = 0; i < 2; i++)
            p.d = kmp_vec_add(g, p.d, kmp_vec_scale(g, kmp_const(g, touch->side[0].at[i]), p.axes[0][i]));
    }
    return p;
}

/* -- shapes of the second side --------------------------------------------------------------------------- */

static void on_plane(const pair *p, kmp_touching *out)
{
    kmp_graph *g = p->tree->graph;
    const kmp_touch_side *side = p->touch->side;
    kmp_vec axis = p->axes[1][side[1].axis], e = p->axes[0][side[0].axis];
    kmp_vec n = side[1].against ? kmp_vec_sub(g, kmp_vec_zero(), axis) : axis;
    kmp_ref height = kmp_vec_dot(g, n, p->d), tilt = kmp_vec_dot(g, n, e);
    out->normal = n;
    if (side[0].shape == KMP_TOUCH_SPHERE || tilt == KMP_ZERO) {
        out->gap = kmp_sub(g, height, p->radius[0]);
        out->arm[0] = kmp_vec_scale(g, kmp_neg(p->radius[0]), n);
        return;
    }
    kmp_ref reach = kmp_sqrt(g, kmp_sub(g, KMP_ONE, kmp_mul(g, tilt, tilt)));
    kmp_vec towards = kmp_vec_sub(g, kmp_vec_scale(g, tilt, e), n);
    out->gap = kmp_sub(g, height, kmp_mul(g, p->radius[0], reach));
    out->arm[0] = kmp_vec_scale(g, kmp_div(g, p->radius[0], reach), towards);
}

/* Around a point or an axis. */
static void on_round(const pair *p, kmp_touching *out)
{
    kmp_graph *g = p->tree->graph;
    const kmp_touch_side *second = &p->touch->side[1];
    kmp_vec e = p->axes[1][second->axis], from = p->d;
    if (second->shape == KMP_TOUCH_CYLINDER)
        from = kmp_vec_sub(g, from, kmp_vec_scale(g, kmp_vec_dot(g, e, from), e));
    /* of a ball in its socket the distance in contact: the same there, and smooth at the centre */
    kmp_ref size = p->touch->clearance ? kmp_tree_expression(p->tree, p->touch->clearance)
                                       : kmp_sqrt(g, kmp_vec_dot(g, from, from));
    kmp_vec out_of = kmp_vec_scale(g, kmp_div(g, KMP_ONE, size), from);
    kmp_ref both = second->hollow ? kmp_sub(g, p->radius[1], p->radius[0]) : kmp_add(g, p->radius[1], p->radius[0]);
    out->normal = second->hollow ? kmp_vec_sub(g, kmp_vec_zero(), out_of) : out_of;
    out->gap = second->hollow ? kmp_sub(g, both, size) : kmp_sub(g, size, both);
    out->arm[0] = kmp_vec_scale(g, kmp_neg(p->radius[0]), out->normal);
}

static void on_profile(const pair *p, kmp_touching *out)
{
    kmp_graph *g = p->tree->graph;
    const kmp_vec *e = p->axes[1];
    bool folds;
    kmp_table *curve = kmp_parallel_curve(p->touch->side[1].table->table, p->touch->radius[0].value, &folds);
    int table = kmp_graph_add_table(g, curve);
    kmp_table_free(curve);
    kmp_ref x = kmp_vec_dot(g, e[0], p->d), y = kmp_vec_dot(g, e[1], p->d);
    kmp_ref slope = kmp_table_derivative_at(g, table, 1, x);
    kmp_ref size = kmp_sqrt(g, kmp_add(g, KMP_ONE, kmp_mul(g, slope, slope)));
    kmp_vec n = kmp_vec_sub(g, e[1], kmp_vec_scale(g, slope, e[0]));
    out->normal = kmp_vec_scale(g, kmp_div(g, KMP_ONE, size), n);
    out->gap = kmp_div(g, kmp_sub(g, y, kmp_table_at(g, table, x)), size);
    out->arm[0] = kmp_vec_scale(g, kmp_neg(p->radius[0]), out->normal);
}

/* The circle of the first side in the axes of the second side's point. */
static kmp_circle_place place_of(const pair *p)
{
    kmp_graph *g = p->tree->graph;
    const kmp_outline_part *part = p->touch->side[1].piece;
    kmp_circle_place place = {0};
    bool meets_corner = false;
    for (const kmp_outline_part *of = part; of; of = of->next)
        meets_corner = meets_corner || of->meets_corner;
    for (int i = 0; i < 3; i++)
        place.at.x[i] = kmp_vec_dot(g, p->axes[1][i], p->d);
    for (int k = 0; k < 2 && meets_corner; k++) {
        const kmp_vec edge = kmp_vec_add(g, kmp_vec_scale(g, kmp_const(g, part->edge[k][0]), p->axes[0][0]),
                                         kmp_vec_scale(g, kmp_const(g, part->edge[k][1]), p->axes[0][1]));
        for (int i = 0; i < 2; i++)
            place.edge[k][i] = kmp_vec_dot(g, p->axes[1][i], edge);
    }
    return place;
}

static void on_cam(const pair *p, kmp_touching *out)
{
    const kmp_touch_side *side = p->touch->side;
    const int points[2] = {side[1].point, side[0].point};
    double face[3] = {0};
    kmp_cam_contact contact;
    face[side[0].axis] = side[0].against ? -1 : 1;
    kmp_cam_contact_find(p->tree, side[1].cam, points, face, &contact);
    out->gap = contact.gap;
    out->normal = contact.normal;
    out->arm[0] = contact.arm;
}

static void on_piece(const pair *p, kmp_touching *out)
{
    kmp_graph *g = p->tree->graph;
    const kmp_circle_place place = place_of(p);
    kmp_ref normal[2];
    out->gap = kmp_outline_gap(p->tree, p->touch, &place, p->radius[0]);
    kmp_outline_normal(p->tree, p->touch, &place, normal);
    out->normal =
        kmp_vec_add(g, kmp_vec_scale(g, normal[0], p->axes[1][0]), kmp_vec_scale(g, normal[1], p->axes[1][1]));
    out->arm[0] = kmp_vec_scale(g, kmp_neg(p->radius[0]), out->normal);
}

/* -- slip ------------------------------------------------------------------------------------------------ */

/* d' + w1 x arm1 - w2 x arm2, relative to the frame; its motion cancels out, because both arms end at one place. */
static kmp_vec slip_of(const pair *p, const kmp_touching *t)
{
    const kmp_tree *tree = p->tree;
    kmp_graph *g = tree->graph;
    kmp_vec v = kmp_vec_rate(tree, p->d), turning[2];
    for (int k = 0; k < 2; k++)
        turning[k] =
            kmp_vec_cross(g, kmp_link_spin(tree, kmp_point_link(tree, p->touch->side[k].point), p->frame), t->arm[k]);
    return kmp_vec_add(g, v, kmp_vec_sub(g, turning[0], turning[1]));
}

void kmp_touching_find(const kmp_tree *tree, const kmp_contact_pair *touch, bool slips, kmp_touching *touching)
{
    kmp_graph *g = tree->graph;
    const pair p = pair_of(tree, touch);
    *touching = (kmp_touching){.frame = p.frame, .across = kmp_vec_zero()};
    switch (touch->side[1].shape) {
    case KMP_TOUCH_PLANE:
        on_plane(&p, touching);
        break;
    case KMP_TOUCH_PROFILE:
        on_profile(&p, touching);
        break;
    case KMP_TOUCH_CAM:
        on_cam(&p, touching);
        break;
    case KMP_TOUCH_PIECE:
        on_piece(&p, touching);
        break;
    default:
        on_round(&p, touching);
    }
    touching->arm[1] = kmp_vec_add(g, p.d, touching->arm[0]);
    if (!slips)
        return;
    kmp_vec v = slip_of(&p, touching), n = touching->normal;
    touching->across = kmp_vec_sub(g, v, kmp_vec_scale(g, kmp_vec_dot(g, v, n), n));
}

/* -- the distance ------------------------------------------------------------------------------------------ */

kmp_ref kmp_touching_gap(const kmp_tree *tree, const kmp_contact_pair *touch)
{
    kmp_touching t;
    if (touch->gap)
        return kmp_tree_bent(tree, touch->gap);
    if (touch->motion >= 0) {
        kmp_ref limit = kmp_tree_number(tree, &touch->limit);
        kmp_ref beyond = kmp_sub(tree->graph, kmp_input(tree->graph, KMP_IN_Q, (uint32_t)touch->motion), limit);
        return touch->upper ? kmp_neg(beyond) : beyond;
    }
    if (touch->side[1].shape == KMP_TOUCH_PIECE) {
        const pair p = pair_of(tree, touch);
        const kmp_circle_place place = place_of(&p);
        return kmp_outline_gap(tree, touch, &place, p.radius[0]);
    }
    kmp_touching_find(tree, touch, false, &t);
    return t.gap;
}

kmp_ref kmp_touching_rate(const kmp_tree *tree, const kmp_contact_pair *touch)
{
    return kmp_vec_rate(tree, (kmp_vec){{kmp_touching_gap(tree, touch), KMP_ZERO, KMP_ZERO}}).x[0];
}

int kmp_touching_slopes(const kmp_tree *tree, const kmp_contact_pair *touch, int **motion, kmp_ref **slope)
{
    return kmp_gradient(tree->graph, kmp_touching_gap(tree, touch), KMP_IN_Q, tree->model->motion_count, motion, slope);
}

/* -- the way ----------------------------------------------------------------------------------------------- */

/* The angle of the first body relative to the second about an axis of the second's point; false: it is not a sum
 * of coordinates. */
static bool turned_about(const kmp_tree *tree, const kmp_contact_pair *touch, int axis, kmp_ref *angle)
{
    int first = touch->side[0].point, second = touch->side[1].point, from = (axis + 1) % 3;
    const kmp_measure_argument axes[3] = {
        {.point = second, .axis = from}, {.point = first, .axis = from}, {.point = second, .axis = axis}};
    return kmp_tree_angle_sum(tree, axes, false, angle);
}

/* The same angle by a virtual displacement of a joint. */
static kmp_ref virtually_turned(const pair *p, int axis)
{
    const kmp_touch_side *side = p->touch->side;
    kmp_ref turn[2];
    for (int k = 0; k < 2; k++)
        turn[k] =
            kmp_virtual_turn(p->tree, kmp_point_link(p->tree, side[k].point), p->frame, p->frame, p->axes[1][axis]);
    return kmp_sub(p->tree->graph, turn[0], turn[1]);
}

/* The way of the first side's rim by rolling about an axis of the second's point; false: the coordinates do not give
 * it. */
static bool rolled_about(const pair *p, int axis, kmp_ref *rolled)
{
    kmp_graph *g = p->tree->graph;
    kmp_ref angle = KMP_ZERO;
    if (p->radius[0] != KMP_ZERO && !turned_about(p->tree, p->touch, axis, &angle))
        return false;
    *rolled = kmp_mul(g, p->radius[0], kmp_add(g, angle, virtually_turned(p, axis)));
    return true;
}

/* True if the first body does not turn relative to the second: no sum of coordinates is its angle about any axis. */
static bool never_turns(const kmp_tree *tree, const kmp_contact_pair *touch)
{
    kmp_ref angle;
    for (int axis = 0; axis < 3; axis++)
        if (!turned_about(tree, touch, axis, &angle) || angle != KMP_ZERO)
            return false;
    return true;
}

/* The axis of the second side's point about which the motion is plane, through the centre of a sphere; -1: none. */
static int plane_axis(const pair *p)
{
    const kmp_touch_side *side = p->touch->side;
    for (int axis = 0; axis < 3; axis++) {
        bool about = side[1].shape == KMP_TOUCH_SPHERE ? kmp_vec_dot(p->tree->graph, p->axes[1][axis], p->d) == KMP_ZERO
                                                       : axis == side[1].axis;
        const kmp_measure_argument normal = {.point = side[1].point, .axis = axis};
        if (about && kmp_moves_across(p->tree->model, side[0].point, &normal))
            return axis;
    }
    return -1;
}

/* Around a cylinder or a sphere of radius R the centre moves by (R + r) da, or by (R - r) da inside, where a is its
 * angle about axis k. A turn about this axis moves the place at -r n against it, inside along it. */
static bool way_around(const pair *p, kmp_ref *way, kmp_ref *turn)
{
    kmp_graph *g = p->tree->graph;
    bool hollow = p->touch->side[1].hollow;
    int k = plane_axis(p);
    kmp_ref rolled;
    if (k < 0 || !rolled_about(p, k, &rolled))
        return false;
    kmp_ref x = kmp_vec_dot(g, p->axes[1][(k + 1) % 3], p->d), y = kmp_vec_dot(g, p->axes[1][(k + 2) % 3], p->d);
    *turn = hollow ? kmp_sub(g, p->radius[1], p->radius[0]) : kmp_add(g, p->radius[1], p->radius[0]);
    *way = kmp_add(g, kmp_mul(g, *turn, kmp_binary(g, KMP_OP_ATAN2, y, x)), hollow ? rolled : kmp_neg(rolled));
    return true;
}

/* The rate along a piece of an outline where the angle of the circle is not a sum of coordinates: r w is what it rolls.
 */
static kmp_ref slip_along(const pair *p)
{
    kmp_graph *g = p->tree->graph;
    const kmp_touch_side *side = p->touch->side;
    const kmp_circle_place place = place_of(p);
    kmp_vec spin[2];
    for (int k = 0; k < 2; k++)
        spin[k] = kmp_link_spin(p->tree, kmp_point_link(p->tree, side[k].point), p->frame);
    const kmp_ref turning = kmp_vec_dot(g, kmp_vec_sub(g, spin[0], spin[1]), p->axes[1][2]);
    const kmp_ref passed = kmp_outline_slip(p->tree, p->touch, &place, p->radius[0], KMP_ZERO);
    return kmp_sub(g, passed, kmp_mul(g, p->radius[0], turning));
}

/* Along a piece of an outline. */
static bool way_along(const pair *p, kmp_ref *way, kmp_ref *turn)
{
    const kmp_circle_place place = place_of(p);
    kmp_ref rolled;
    if (!rolled_about(p, 2, &rolled))
        return false;
    *way = kmp_outline_way(p->tree, p->touch, &place, p->radius[0], rolled, turn);
    return true;
}

/* With the normal along axis k of the plane's point, the slip is along axis k + 1 or k + 2. A turn about b = n x t
 * moves the place at -r n by -r t. A normal against the axis turns the sign of that. */
bool kmp_touching_way(const kmp_tree *tree, const kmp_contact_pair *touch, int along, kmp_ref *way, kmp_ref *turn)
{
    kmp_graph *g = tree->graph;
    *turn = KMP_ZERO;
    if (touch->way) {
        *way = kmp_tree_expression(tree, touch->way);
        return true;
    }
    if (touch->gap || touch->motion >= 0 || touch->side[1].shape == KMP_TOUCH_PROFILE ||
        touch->side[1].shape == KMP_TOUCH_CAM)
        return false;
    const pair p = pair_of(tree, touch);
    if (touch->side[1].shape == KMP_TOUCH_PIECE)
        return way_along(&p, way, turn);
    if (touch->side[1].shape != KMP_TOUCH_PLANE)
        return way_around(&p, way, turn);
    const int k = touch->side[1].axis, i = (k + 1) % 3, j = (k + 2) % 3;
    if (along > 0 && p.radius[0] != KMP_ZERO && !never_turns(p.tree, p.touch))
        return false;
    const int across = along == 0 ? kmp_touch_plane(tree->model, touch) : along == 1 ? j : i;
    const bool along_i = across == j;
    kmp_ref rolled;
    if (across < 0 || !rolled_about(&p, across, &rolled))
        return false;
    rolled = along_i != touch->side[1].against ? rolled : kmp_neg(rolled);
    *way = kmp_sub(g, kmp_vec_dot(g, p.axes[1][along_i ? i : j], p.d), rolled);
    return true;
}

/* -- components of the slip ---------------------------------------------------------------------------------- */

/* Across the axis of the plane of motion. */
static kmp_vec direction_in_plane(const pair *p, kmp_vec n)
{
    kmp_graph *g = p->tree->graph;
    kmp_vec axis = p->axes[1][kmp_touch_plane(p->tree->model, p->touch)], t = kmp_vec_cross(g, n, axis);
    kmp_ref lean = kmp_vec_dot(g, n, axis);
    if (lean == KMP_ZERO)
        return t;
    kmp_ref size = p->touch->clearance ? kmp_sqrt(g, kmp_sub(g, KMP_ONE, kmp_mul(g, lean, lean))) /* |n| is 1 there */
                                       : kmp_sqrt(g, kmp_vec_dot(g, t, t));
    return kmp_vec_scale(g, kmp_div(g, KMP_ONE, size), t);
}

/* On a sphere: the axes x and y of its point, turned by the least rotation from z to n, or from -z where n is closer to
 * it. No pair of directions is smooth on a whole sphere; either of these is, but at the other pole. The change between
 * them lags, so that motions near the equator do not alternate. */
static kmp_vec direction_on_sphere(const pair *p, kmp_vec n, int along)
{
    kmp_graph *g = p->tree->graph;
    const kmp_vec *e = p->axes[1];
    kmp_ref up = kmp_vec_dot(g, n, e[2]), twice = kmp_const(g, 2);
    kmp_ref below = kmp_tree_condition(p->tree, p->touch, 0, up, LOWER_POLE, NULL,
                                       "slip on the sphere at '%s' in the directions of -z",
                                       p->tree->model->points[p->touch->side[1].point].name);
    kmp_ref side = kmp_sub(g, KMP_ONE, kmp_mul(g, twice, below));
    kmp_ref part = kmp_div(g, kmp_vec_dot(g, n, e[along - 1]), kmp_add(g, KMP_ONE, kmp_mul(g, side, up)));
    return kmp_vec_sub(g, e[along - 1], kmp_vec_scale(g, part, kmp_vec_add(g, n, kmp_vec_scale(g, side, e[2]))));
}

/* Both directions of slip on a surface. */
static kmp_vec direction_on_surface(const pair *p, kmp_vec n, int along)
{
    kmp_graph *g = p->tree->graph;
    const kmp_touch_side *second = &p->touch->side[1];
    const kmp_vec *e = p->axes[1];
    switch (second->shape) {
    case KMP_TOUCH_PLANE:
        return e[(second->axis + along) % 3];
    case KMP_TOUCH_CYLINDER:
        return along == 1 ? e[second->axis] : kmp_vec_cross(g, n, e[second->axis]);
    case KMP_TOUCH_PROFILE:
    case KMP_TOUCH_CAM:
        return along == 1 ? kmp_vec_cross(g, n, e[2]) : e[2];
    default:
        return direction_on_sphere(p, n, along);
    }
}

kmp_ref kmp_touching_slip(const kmp_tree *tree, const kmp_contact_pair *touch, int along)
{
    if (touch->slip)
        return kmp_tree_expression(tree, touch->slip);
    const pair p = pair_of(tree, touch);
    kmp_touching t;
    if (touch->side[1].shape == KMP_TOUCH_PIECE)
        return slip_along(&p);
    kmp_touching_find(tree, touch, false, &t);
    kmp_vec direction = along == 0 ? direction_in_plane(&p, t.normal) : direction_on_surface(&p, t.normal, along);
    return kmp_vec_dot(tree->graph, direction, slip_of(&p, &t));
}

/* By the same cases as the ways. */
kmp_vec kmp_touching_direction(const kmp_tree *tree, const kmp_contact_pair *touch, kmp_vec n, int along)
{
    kmp_graph *g = tree->graph;
    const kmp_touch_side *second = &touch->side[1];
    const pair p = pair_of(tree, touch);
    const kmp_vec *e = p.axes[1];
    kmp_ref way = KMP_ZERO, turn;
    if (along > 0)
        return direction_on_surface(&p, n, along);
    if (second->shape == KMP_TOUCH_PIECE)
        return kmp_vec_cross(g, e[2], n);
    if (!kmp_touching_way(tree, touch, 0, &way, &turn))
        return direction_in_plane(&p, n);
    if (second->shape != KMP_TOUCH_PLANE)
        return kmp_vec_cross(g, e[plane_axis(&p)], second->hollow ? kmp_vec_sub(g, kmp_vec_zero(), n) : n);
    const int i = (second->axis + 1) % 3, j = (second->axis + 2) % 3;
    return e[kmp_touch_plane(tree->model, touch) == j ? i : j];
}

/* -- loads of bearings ------------------------------------------------------------------------------- */

/* Compliant contacts: depth, its rate and the slip of two surfaces, or of a journal in its bearing; then the normal
 * force by the law of the contact, zero apart. */

/* Over lengths. */
#define KMP_CONTACT_LAG 1e-15

/* The slip of two sides. */
static void find_sides(const kmp_tree *tree, const kmp_force *force, kmp_bearing_load *pressing)
{
    const kmp_contact_pair *touch = &force->touch;
    kmp_touching sides;
    kmp_ref rolled = KMP_ZERO;
    if (!force->holding_effort || touch->side[0].point < 0)
        return;
    if (touch->side[1].shape == KMP_TOUCH_PIECE) {
        const pair p = pair_of(tree, touch);
        const kmp_circle_place place = place_of(&p);
        pressing->slip[0] =
            rolled_about(&p, 2, &rolled) ? kmp_outline_slip(tree, touch, &place, p.radius[0], rolled) : slip_along(&p);
        pressing->slips = 1;
        return;
    }
    kmp_touching_find(tree, touch, true, &sides);
    memcpy(pressing->slip, sides.across.x, sizeof pressing->slip);
    pressing->slips = 3;
}

/* A journal with its centre at (x, y), of a ball (x, y, z), in a bearing of radius R with the radial clearance c: e =
 * |(x, y)|, depth e - c, rate (x x' + y y')/e. Its surface slips with (x y' - y x')/e + (R - c) w along the bearing,
 * which is the velocity of the journal's point of contact. The bodies touch where c^2 - e^2 < 0, which is smooth at the
 * centre, too. */
static void find_journal(const kmp_tree *tree, const kmp_force *force, kmp_bearing_load *pressing)
{
    kmp_graph *g = tree->graph;
    const struct kmp_compliant *made = force->compliant;
    kmp_ref x = kmp_tree_expression(tree, force->vector[0]), y = kmp_tree_expression(tree, force->vector[1]);
    kmp_ref z = made->ball ? kmp_tree_expression(tree, force->vector[2]) : KMP_ZERO;
    kmp_vec rate = kmp_vec_rate(tree, (kmp_vec){{x, y, z}});
    kmp_ref c = kmp_tree_expression(tree, made->clearance), xd = rate.x[0], yd = rate.x[1];
    kmp_ref square = kmp_add(g, kmp_add(g, kmp_mul(g, x, x), kmp_mul(g, y, y)), kmp_mul(g, z, z));
    kmp_ref e = kmp_sqrt(g, square), twice = kmp_add(g, c, c);
    pressing->x = x;
    pressing->y = y;
    pressing->z = z;
    pressing->eccentricity = e;
    pressing->open = kmp_div(g, kmp_sub(g, kmp_mul(g, c, c), square), twice);
    pressing->depth = kmp_sub(g, e, c);
    kmp_ref moving = kmp_add(g, kmp_mul(g, x, xd), kmp_mul(g, y, yd));
    pressing->rate = kmp_div(g, kmp_add(g, moving, kmp_mul(g, z, rate.x[2])), e);
    if (made->ball)
        find_sides(tree, force, pressing);
    if (!made->radius || made->ball)
        return;
    kmp_ref turning = kmp_div(g, kmp_sub(g, kmp_mul(g, x, yd), kmp_mul(g, y, xd)), e);
    kmp_ref arm = kmp_sub(g, kmp_tree_expression(tree, made->radius), c);
    pressing->slip[0] = kmp_add(g, turning, kmp_mul(g, arm, kmp_tree_expression(tree, force->vector[2])));
    pressing->slips = 1;
}

void kmp_bearing_load_find(const kmp_tree *tree, const kmp_force *force, kmp_bearing_load *pressing)
{
    *pressing = (kmp_bearing_load){
        .x = KMP_ZERO, .y = KMP_ZERO, .z = KMP_ZERO, .eccentricity = KMP_ZERO, .slip = {KMP_ZERO, KMP_ZERO, KMP_ZERO}};
    if (force->compliant->form == KMP_COMPLIANT_JOURNAL)
        find_journal(tree, force, pressing);
    else {
        pressing->open = kmp_touching_gap(tree, &force->touch);
        pressing->depth = kmp_neg(pressing->open);
        pressing->rate = kmp_neg(kmp_touching_rate(tree, &force->touch));
        /* The expressions of the user, or the slip of two sides. */
        while (pressing->slips < 3 && force->vector[pressing->slips]) {
            pressing->slip[pressing->slips] = kmp_tree_expression(tree, force->vector[pressing->slips]);
            pressing->slips++;
        }
        find_sides(tree, force, pressing);
    }
}

kmp_ref kmp_bearing_load_holds(const kmp_tree *tree, const kmp_force *force, const kmp_bearing_load *pressing)
{
    double reach = 1;
    for (int k = 0; k < tree->model->point_count; k++)
        for (int i = 0; i < 3; i++)
            reach = fmax(reach, fabs(tree->model->points[k].at[i].value));
    kmp_ref holds = kmp_tree_condition(tree, force, KMP_PRESSING, pressing->open, KMP_CONTACT_LAG * reach, NULL,
                                       "contact of '%s'", force->name);
    int k = tree->conditions.events ? kmp_events_find(tree->conditions.events, force, KMP_PRESSING) : -1;
    if (k >= 0)
        tree->conditions.events->condition[k].measured = true;
    return holds;
}

/* Beyond the end of contact, within a step that is cut there, the law sees the modulus of the depth: powers of it stay
 * defined. */
kmp_ref kmp_bearing_load_law(const kmp_tree *tree, const kmp_force *force, const kmp_bearing_load *pressing,
                             const kmp_expr *law)
{
    kmp_graph *g = tree->graph;
    const kempe_model *model = tree->model;
    const int state = force->compliant->state;
    kmp_ref place[KMP_LOCAL_END] = {KMP_ZERO, KMP_ZERO, KMP_ZERO};
    kmp_tree within = *tree;
    place[KMP_LOCAL_DEPTH] = kmp_unary(g, KMP_OP_ABS, pressing->depth);
    place[KMP_LOCAL_RATE] = pressing->rate;
    place[KMP_LOCAL_IMPACT] =
        state < 0 ? KMP_ZERO : kmp_input(g, KMP_IN_QD, (uint32_t)(kmp_model_coordinates(model) + state));
    place[KMP_LOCAL_SLIP] = pressing->slip[0];
    within.place = place;
    return kmp_tree_expression(&within, law);
}

kmp_ref kmp_bearing_load_coefficient(const kmp_tree *tree, const kmp_force *force, kmp_ref slip)
{
    kmp_ref place[KMP_LOCAL_END] = {[KMP_LOCAL_SLIP] = slip};
    kmp_tree within = *tree;
    within.place = place;
    return kmp_tree_expression(&within, force->holding_effort);
}

kmp_ref kmp_bearing_load_normal(const kmp_tree *tree, const kmp_force *force, const kmp_bearing_load *pressing)
{
    kmp_graph *g = tree->graph;
    kmp_ref holds = kmp_bearing_load_holds(tree, force, pressing);
    kmp_ref law = kmp_bearing_load_law(tree, force, pressing, force->effort);
    kmp_ref pulls = kmp_tree_condition(tree, force, KMP_PRESSING_PULLS, kmp_select(g, holds, law, KMP_ONE), 0, NULL,
                                       "contact of '%s' without force", force->name);
    return kmp_select(g, holds, kmp_select(g, pulls, KMP_ZERO, law), KMP_ZERO);
}

kmp_ref kmp_bearing_load_measure(const kmp_tree *tree, kmp_measure_kind kind, const char *contact)
{
    const kempe_model *model = tree->model;
    kmp_bearing_load pressing;
    int k = kmp_name_find(KMP_NAMED(model, force), contact);
    if (k < 0)
        return KMP_ZERO;
    kmp_bearing_load_find(tree, &model->forces[k], &pressing);
    return kind == KMP_MEASURE_DEPTH      ? pressing.depth
           : kind == KMP_MEASURE_APPROACH ? pressing.rate
                                          : kmp_bearing_load_normal(tree, &model->forces[k], &pressing);
}
