/* SPDX-License-Identifier: BSD-3-Clause */
/* The centre of a law's own roller has the place f(s) on its line, or on the circle of its lever, and is turned with it
 * by u against the cam. A place of the centre in the axes of the cam gives the lift that it would have, and u. Their
 * difference from the law, times the normal part of df/ds, is the distance: exact on the path, with its derivatives
 * there. A face with the normal m at the angle b has the distance (x, y).m - h(b), with the support function h. Any
 * other path is parallel to a curve c(u), by d along its normal n. The parameter u is found from a spline by the angle,
 * with Newton's steps in the expression itself. */
#include "dynamics/kinematics/cam_contact.h"
#include "dynamics/kinematics/kinematics_vectors.h"
#include "dynamics/kinematics/plane_vector.h"
#include "model/data/model.h"
#include "model/data/outline.h"
#include "symbolic/derivative.h"
#include "symbolic/function_table.h"
#include <math.h>
#include <string.h>

/* -- laws as expressions ------------------------------------------------------------------------------------ */

/* A derivative of a piece of a law at u. */
static kmp_ref piece_at(kmp_graph *g, const kmp_cam_piece *piece, int derivative, kmp_ref u)
{
    const kmp_ref beyond = kmp_sub(g, u, kmp_const(g, piece->from));
    kmp_ref value = KMP_ZERO;
    for (int i = 7; i >= derivative; i--) {
        double factor = piece->power[i];
        for (int k = 0; k < derivative; k++)
            factor *= i - k;
        value = kmp_add(g, kmp_mul(g, value, beyond), kmp_const(g, factor));
    }
    if (piece->size == 0)
        return value;
    const kmp_ref turned = kmp_mul(g, kmp_const(g, piece->rate), u);
    const kmp_ref angle = kmp_add(g, turned, kmp_const(g, piece->phase));
    const kmp_ref wave = derivative % 2 ? kmp_cos(g, angle) : kmp_sin(g, angle);
    const double size = piece->size * pow(piece->rate, derivative) * (derivative == 2 || derivative == 3 ? -1 : 1);
    return kmp_add(g, value, kmp_mul(g, kmp_const(g, size), wave));
}

/* A straight table that follows the angle from a piece's beginning to its end, and stays at its ends elsewhere. */
static int follow(kmp_graph *g, const kmp_cam_part *part, const kmp_cam_piece *piece)
{
    const double width = part->to - part->from, a = part->from + piece->from * width,
                 b = part->from + piece->to * width;
    const double x[4] = {a - 1, a, b, b + 1}, y[4] = {piece->from, piece->from, piece->to, piece->to};
    kmp_table *table = kmp_table_new(KMP_TABLE_LINEAR, 4, x, y);
    const int number = kmp_graph_add_table(g, table);
    kmp_table_free(table);
    return number;
}

/* The lift over the angle of the cam, from 0 to a turn, or a derivative by it: the sum of what each piece has risen so
 * far. */
static kmp_ref lift_at(kmp_graph *g, const kmp_cam *cam, int derivative, kmp_ref angle)
{
    kmp_ref sum = KMP_ZERO;
    for (int k = 0; k < cam->part_count; k++) {
        const kmp_cam_part *part = &cam->parts[k];
        int count;
        const kmp_cam_piece *pieces = kmp_cam_pieces(part->law, &count);
        for (int i = 0; i < count && part->rise != 0; i++) {
            const int table = follow(g, part, &pieces[i]);
            if (table < 0)
                return KMP_ZERO;
            kmp_ref risen = piece_at(g, &pieces[i], derivative, kmp_table_at(g, table, angle));
            const kmp_ref rate = kmp_table_derivative_at(g, table, 1, angle);
            for (int d = 0; d < derivative; d++)
                risen = kmp_mul(g, risen, rate);
            if (derivative == 0)
                risen = kmp_sub(g, risen, kmp_const(g, kmp_cam_piece_value(&pieces[i], 0, pieces[i].from)));
            sum = kmp_add(g, sum, kmp_mul(g, kmp_const(g, part->rise), risen));
        }
    }
    return sum;
}

/* The lift of a law at an angle of the cam, and two derivatives by the polar angle, which is opposite. */
static void law_at(kmp_graph *g, const kmp_cam *cam, kmp_ref angle, kmp_ref s[3])
{
    s[0] = kmp_add(g, kmp_const(g, cam->base), lift_at(g, cam, 0, angle));
    s[1] = kmp_neg(lift_at(g, cam, 1, angle));
    s[2] = lift_at(g, cam, 2, angle);
}

/* The same at the polar angle with this cosine and sine, times any length. */
static void law_towards(kmp_graph *g, const kmp_cam *cam, const kmp_ref e[2], kmp_ref s[3])
{
    const kmp_ref turned = kmp_binary(g, KMP_OP_ATAN2, e[1], kmp_neg(e[0]));
    law_at(g, cam, kmp_add(g, turned, kmp_const(g, KMP_TURN / 2)), s);
}

/* Of a follower: its place f over the lift, f = (cos, sin) by the sine and cosine of a lever's lift
 * or the lift itself, and its first two derivatives by the lift. */
static void follower_place(kmp_graph *g, const kmp_cam *cam, kmp_ref lift, kmp_ref cosine, kmp_ref sine,
                           kmp_ref f[3][2])
{
    const double side = copysign(1, cam->arm), l = fabs(cam->arm);
    if (cam->arm == 0) {
        const kmp_ref line[3][2] = {{lift, kmp_const(g, -cam->offset)}, {KMP_ONE, KMP_ZERO}, {KMP_ZERO, KMP_ZERO}};
        memcpy(f, line, sizeof line);
        return;
    }
    f[2][0] = kmp_mul(g, kmp_const(g, l), cosine);
    f[2][1] = kmp_mul(g, kmp_const(g, -side * l), sine);
    f[1][0] = kmp_mul(g, kmp_const(g, l), sine);
    f[1][1] = kmp_mul(g, kmp_const(g, side * l), cosine);
    f[0][0] = kmp_sub(g, kmp_const(g, cam->pivot), f[2][0]);
    f[0][1] = kmp_neg(f[2][1]);
}

/* The derivatives by u of a place that is f(s(u)) turned by u, in the axes of f: f' + J f, f'' + 2 J f' - f with
 * J (x, y) = (-y, x). */
static void turned_place(kmp_graph *g, const kmp_ref s[3], const kmp_ref f[3][2], kmp_ref turned[2][2])
{
    kmp_ref f1[2], f2[2];
    for (int i = 0; i < 2; i++) {
        f1[i] = kmp_mul(g, s[1], f[1][i]);
        f2[i] = kmp_add(g, kmp_mul(g, s[2], f[1][i]), kmp_mul(g, kmp_mul(g, s[1], s[1]), f[2][i]));
    }
    turned[0][0] = kmp_sub(g, f1[0], f[0][1]);
    turned[0][1] = kmp_add(g, f1[1], f[0][0]);
    turned[1][0] = kmp_sub(g, f2[0], kmp_add(g, kmp_add(g, f1[1], f1[1]), f[0][0]));
    turned[1][1] = kmp_sub(g, f2[1], kmp_sub(g, f[0][1], kmp_add(g, f1[0], f1[0])));
}

/* -- curves ------------------------------------------------------------------------------------------------- */

/* A place of the base curve: c, its derivative t by the parameter, the unit normal n outwards and the curvature. */
typedef struct curve_place {
    kmp_ref c[2], t[2], n[2], k;
} curve_place;

/* From the first two derivatives: unit normal and curvature. */
static void set_normal(kmp_graph *g, const kmp_ref t[2], const kmp_ref bend[2], kmp_ref n[2], kmp_ref *k)
{
    const kmp_ref square = kmp_plane_dot(g, t, t), size = kmp_sqrt(g, square);
    n[0] = kmp_div(g, t[1], size);
    n[1] = kmp_neg(kmp_div(g, t[0], size));
    *k = kmp_div(g, kmp_plane_cross(g, t, bend), kmp_mul(g, square, size));
}

/* x less whole periods, from first to the end of the period. */
static kmp_ref within_period(kmp_graph *g, double first, double period, kmp_ref x)
{
    const kmp_ref beyond = kmp_sub(g, x, kmp_const(g, first));
    const kmp_ref turns = kmp_unary(g, KMP_OP_FLOOR, kmp_div(g, beyond, kmp_const(g, period)));
    return kmp_sub(g, x, kmp_mul(g, kmp_const(g, period), turns));
}

/* Value and two derivatives of a periodic table. */
static void table_place(kmp_graph *g, kmp_table *table, kmp_ref x, kmp_ref r[3])
{
    const int number = kmp_graph_add_table(g, table);
    const double first = table->x[0];
    const kmp_ref within = within_period(g, first, table->x[table->count - 1] - first, x);
    r[0] = number < 0 ? KMP_ONE : kmp_table_at(g, number, within);
    for (int d = 1; d < 3; d++)
        r[d] = number < 0 ? KMP_ONE : kmp_table_derivative_at(g, number, d, within);
}

/* The base curve at a parameter: of places their length, else an angle. */
static curve_place curve_at(kmp_graph *g, const kmp_cam *cam, kmp_ref u)
{
    curve_place at;
    kmp_ref r[3], bend[2];
    if (cam->place[0]) {
        for (int i = 0; i < 2; i++) {
            table_place(g, cam->place[i], u, r);
            at.c[i] = r[0];
            at.t[i] = r[1];
            bend[i] = r[2];
        }
        set_normal(g, at.t, bend, at.n, &at.k);
        return at;
    }
    const kmp_ref e[2] = {kmp_cos(g, u), kmp_sin(g, u)};
    if (cam->table)
        table_place(g, cam->table, u, r);
    else
        law_at(g, cam, within_period(g, 0, KMP_TURN, kmp_neg(u)), r);
    if (cam->parts && cam->form == KMP_FOLLOWER_FLAT) { /* by the support function: h e + h' e', (h + h'') e' */
        const kmp_ref own[2] = {r[0], r[1]}, ahead[2] = {KMP_ZERO, kmp_add(g, r[0], r[2])};
        kmp_plane_turn(g, e, own, at.c);
        kmp_plane_turn(g, e, ahead, at.t);
        memcpy(at.n, e, sizeof at.n);
        at.k = kmp_div(g, KMP_ONE, ahead[1]);
        return at;
    }
    kmp_ref f[3][2] = {{r[0], KMP_ZERO}, {KMP_ONE, KMP_ZERO}, {KMP_ZERO, KMP_ZERO}}, own[2][2];
    if (cam->parts) {
        const kmp_ref sine = kmp_sin(g, r[0]);
        follower_place(g, cam, r[0], kmp_cos(g, r[0]), sine, f);
    }
    turned_place(g, r, (const kmp_ref(*)[2])f, own);
    kmp_plane_turn(g, e, f[0], at.c);
    kmp_plane_turn(g, e, own[0], at.t);
    kmp_plane_turn(g, e, own[1], bend);
    set_normal(g, at.t, bend, at.n, &at.k);
    return at;
}

/* The place of the base curve whose parallel place, at the distance d, is towards (x, y); for a flat face, whose
 * normal is. */
static curve_place foot_of(kmp_graph *g, const kmp_cam_follower *follower, double d, const kmp_ref towards[2])
{
    const kmp_cam *cam = follower->outline->cam;
    kmp_cam_check checked; /* by the reader */
    kmp_table *parts = kmp_cam_parameter(cam, follower, &checked);
    const int table = kmp_graph_add_table(g, parts);
    kmp_table_free(parts);
    kmp_ref u = table < 0 ? KMP_ONE : kmp_table_at(g, table, kmp_binary(g, KMP_OP_ATAN2, towards[1], towards[0]));
    curve_place at = curve_at(g, cam, u);
    for (int i = 0; i < KMP_CAM_STEPS; i++) {
        kmp_ref off, rate;
        if (follower->form == KMP_FOLLOWER_FLAT) { /* t.m, and t'.m = -k t^2 where m is the normal */
            off = kmp_plane_dot(g, at.t, towards);
            rate = kmp_neg(kmp_mul(g, at.k, kmp_plane_dot(g, at.t, at.t)));
        } else {
            const kmp_ref along = kmp_add(g, KMP_ONE, kmp_mul(g, kmp_const(g, d), at.k));
            const kmp_ref p[2] = {kmp_add(g, at.c[0], kmp_mul(g, kmp_const(g, d), at.n[0])),
                                  kmp_add(g, at.c[1], kmp_mul(g, kmp_const(g, d), at.n[1]))};
            off = kmp_plane_cross(g, p, towards);
            rate = kmp_mul(g, along, kmp_plane_cross(g, at.t, towards));
        }
        u = kmp_sub(g, u, kmp_div(g, off, rate));
        at = curve_at(g, cam, u);
    }
    return at;
}

/* -- followers ------------------------------------------------------------------------------------------------ */

/* The cam's axes, and the vector from its centre to the follower's point in its axes x and y. */
typedef struct cam_place {
    kmp_graph *g;
    kmp_vec axes[3];
    kmp_ref at[2];
} cam_place;

static kmp_vec combined(const cam_place *c, const kmp_ref v[2])
{
    return kmp_vec_add(c->g, kmp_vec_scale(c->g, v[0], c->axes[0]), kmp_vec_scale(c->g, v[1], c->axes[1]));
}

/* A circle about another centre than the origin of the outline. */
static void roll_on_circle(const cam_place *c, const kmp_cam_follower *follower, kmp_cam_contact *out)
{
    kmp_graph *g = c->g;
    const kmp_piece *circle = &follower->outline->pieces[0];
    kmp_ref u[2];
    kmp_plane_from(g, circle->centre, c->at, u);
    const kmp_ref r = kmp_sqrt(g, kmp_plane_dot(g, u, u)), n[2] = {kmp_div(g, u[0], r), kmp_div(g, u[1], r)};
    out->gap = kmp_sub(g, r, kmp_const(g, circle->radius + follower->radius));
    out->normal = combined(c, n);
    out->curvature = kmp_const(g, 1 / circle->radius);
}

/* The law's own roller or edge. */
static void roll_by_law(const cam_place *c, const kmp_cam_follower *follower, kmp_cam_contact *out)
{
    kmp_graph *g = c->g;
    const kmp_cam *cam = follower->outline->cam;
    const double l = fabs(cam->arm);
    const kmp_ref square = kmp_plane_dot(g, c->at, c->at);
    kmp_ref f[3][2], lift, cosine = KMP_ONE, sine = KMP_ZERO;
    if (cam->arm != 0) { /* the triangle of bearing, centre and roller */
        const kmp_ref rest = kmp_sub(g, kmp_const(g, cam->pivot * cam->pivot + l * l), square);
        cosine = kmp_mul(g, kmp_const(g, 1 / (2 * cam->pivot * l)), rest);
        sine = kmp_sqrt(g, kmp_sub(g, KMP_ONE, kmp_mul(g, cosine, cosine)));
        lift = kmp_binary(g, KMP_OP_ATAN2, sine, cosine);
    } else
        lift = kmp_sqrt(g, kmp_sub(g, square, kmp_const(g, cam->offset * cam->offset)));
    follower_place(g, cam, lift, cosine, sine, f);
    /* x axis of f: the place is f[0] of it and f[1] of the axis across */
    const kmp_ref e[2] = {kmp_div(g, kmp_plane_dot(g, f[0], c->at), square),
                          kmp_div(g, kmp_plane_cross(g, f[0], c->at), square)};
    kmp_ref s[3];
    law_towards(g, cam, e, s);
    kmp_ref own[2][2], n[2], across[2], of_path;
    turned_place(g, s, (const kmp_ref(*)[2])f, own);
    set_normal(g, own[0], own[1], n, &of_path);
    out->gap = kmp_mul(g, kmp_sub(g, lift, s[0]), kmp_plane_dot(g, n, f[1]));
    kmp_plane_turn(g, e, n, across);
    out->normal = combined(c, across);
    out->curvature = kmp_div(g, of_path, kmp_sub(g, KMP_ONE, kmp_mul(g, kmp_const(g, follower->radius), of_path)));
}

static void roll_on_curve(const cam_place *c, const kmp_cam_follower *follower, kmp_cam_contact *out)
{
    kmp_graph *g = c->g;
    const double inset = kmp_cam_inset(follower->outline->cam), d = follower->radius - inset;
    const curve_place at = foot_of(g, follower, d, c->at);
    const kmp_ref off[2] = {kmp_sub(g, c->at[0], at.c[0]), kmp_sub(g, c->at[1], at.c[1])};
    out->gap = kmp_sub(g, kmp_plane_dot(g, off, at.n), kmp_const(g, d));
    out->normal = combined(c, at.n);
    out->curvature = kmp_div(g, at.k, kmp_sub(g, KMP_ONE, kmp_mul(g, kmp_const(g, inset), at.k)));
}

/* The face with the normal m touches at h m + h' t, with t across m. */
static void lie_on_profile(const cam_place *c, const kmp_cam_follower *follower, kmp_vec m, kmp_cam_contact *out)
{
    kmp_graph *g = c->g;
    const kmp_ref normal[2] = {kmp_vec_dot(g, m, c->axes[0]), kmp_vec_dot(g, m, c->axes[1])};
    const kmp_ref across[2] = {kmp_neg(normal[1]), normal[0]};
    const kmp_cam *cam = follower->outline->cam;
    kmp_ref height, along;
    if (cam && kmp_cam_is_exact(cam, follower)) {
        kmp_ref h[3];
        law_towards(g, cam, normal, h);
        height = h[0];
        along = h[1];
        out->curvature = kmp_div(g, KMP_ONE, kmp_add(g, h[0], h[2]));
    } else if (cam) {
        const double d = -kmp_cam_inset(cam);
        const curve_place at = foot_of(g, follower, d, normal);
        height = kmp_add(g, kmp_plane_dot(g, at.c, normal), kmp_const(g, d));
        along = kmp_plane_dot(g, at.c, across);
        out->curvature = kmp_div(g, at.k, kmp_add(g, KMP_ONE, kmp_mul(g, kmp_const(g, d), at.k)));
    } else {
        const kmp_piece *circle = &follower->outline->pieces[0];
        const kmp_ref centre[2] = {kmp_const(g, circle->centre[0]), kmp_const(g, circle->centre[1])};
        height = kmp_add(g, kmp_const(g, circle->radius), kmp_plane_dot(g, centre, normal));
        along = kmp_plane_dot(g, centre, across);
        out->curvature = kmp_const(g, 1 / circle->radius);
    }
    out->normal = m;
    out->gap = kmp_sub(g, kmp_plane_dot(g, c->at, normal), height);
    /* back to the face from the place on the cam, where they are apart */
    out->arm = kmp_vec_scale(g, kmp_sub(g, along, kmp_plane_dot(g, across, c->at)), combined(c, across));
}

void kmp_cam_contact_find(const kmp_tree *tree, const kmp_cam_follower *follower, const int point[2],
                          const double face[3], kmp_cam_contact *contact)
{
    kmp_graph *g = tree->graph;
    cam_place c = {.g = g};
    const kmp_vec d = kmp_point_difference(tree, point[0], point[1], &contact->frame);
    kmp_point_axes(tree, point[0], contact->frame, c.axes);
    for (int i = 0; i < 2; i++)
        c.at[i] = kmp_vec_dot(g, c.axes[i], d);
    contact->axis = c.axes[2];
    if (follower->form == KMP_FOLLOWER_FLAT) {
        lie_on_profile(&c, follower, kmp_point_direction(tree, point[1], face, contact->frame), contact);
        return;
    }
    const kmp_cam *cam = follower->outline->cam;
    if (!cam)
        roll_on_circle(&c, follower, contact);
    else if (!kmp_cam_is_exact(cam, follower))
        roll_on_curve(&c, follower, contact);
    else
        roll_by_law(&c, follower, contact);
    contact->arm = kmp_vec_scale(g, kmp_const(g, -follower->radius), contact->normal);
}

kmp_vec kmp_cam_load(const kmp_tree *tree, const kmp_closure *closure, kmp_ref lambda, bool moment)
{
    kmp_cam_contact contact;
    kmp_cam_contact_find(tree, closure->cam, closure->point, closure->axis[1], &contact);
    const kmp_point *points = tree->model->points, *p = &points[closure->point[0]], *q = &points[closure->point[1]];
    kmp_vec load = kmp_vec_scale(tree->graph, lambda, contact.normal);
    if (moment)
        load = closure->cam->form == KMP_FOLLOWER_FLAT ? kmp_vec_cross(tree->graph, contact.arm, load) : kmp_vec_zero();
    return kmp_body_vector_back(tree, kmp_model_common_body(tree->model, p->body, q->body), load);
}

kmp_ref kmp_cam_pressure_angle(const kmp_tree *tree, const kmp_cam_contact *contact, int point, int motion)
{
    kmp_graph *g = tree->graph;
    const kmp_vec place = kmp_point_position(tree, point, 0);
    const kmp_vec n = kmp_link_direction(tree, contact->frame, contact->normal, 0);
    const kmp_vec z = kmp_link_direction(tree, contact->frame, contact->axis, 0);
    const int n_q = tree->model->motion_count;
    kmp_ref *slope = KMP_GRAPH_NEW(g, kmp_ref, 3 * n_q + 1);
    if (!slope)
        return KMP_ZERO;
    kmp_partials_all(g, 3, place.x, KMP_IN_Q, n_q, slope);
    const kmp_vec v = {{slope[motion], slope[n_q + motion], slope[2 * n_q + motion]}};
    const kmp_ref across = kmp_vec_dot(g, kmp_vec_cross(g, v, n), z);
    return kmp_unary(g, KMP_OP_ATAN, kmp_div(g, across, kmp_vec_dot(g, v, n)));
}
