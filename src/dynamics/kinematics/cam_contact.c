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

/* -- formulas as expressions ------------------------------------------------------------------------------- */

typedef kmp_ref value;
#define NUMBER(x)      kmp_const(g, x)
#define ADD(a, b)      kmp_add(g, a, b)
#define SUB(a, b)      kmp_sub(g, a, b)
#define MUL(a, b)      kmp_mul(g, a, b)
#define DIV(a, b)      kmp_div(g, a, b)
#define NEG(a)         kmp_neg(a)
#define ROOT(a)        kmp_sqrt(g, a)
#define SINE(a)        kmp_sin(g, a)
#define COSINE(a)      kmp_cos(g, a)
#define FLOOR(a)       kmp_unary(g, KMP_OP_FLOOR, a)
#define DOT(a, b)      kmp_plane_dot(g, a, b)
#define CROSS(a, b)    kmp_plane_cross(g, a, b)
#define TURN(e, v, to) kmp_plane_turn(g, e, v, to)
#include "model/data/cam_formulas.def"

static void table_at(kmp_graph *g, kmp_table *table, kmp_ref x, kmp_ref r[3])
{
    const int number = kmp_graph_add_table(g, table);
    r[0] = number < 0 ? KMP_ONE : kmp_table_at(g, number, x);
    for (int d = 1; d < 3; d++)
        r[d] = number < 0 ? KMP_ONE : kmp_table_derivative_at(g, number, d, x);
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

/* The same at the polar angle with this cosine and sine, times any length. */
static void law_towards(kmp_graph *g, const kmp_cam *cam, const kmp_ref e[2], kmp_ref s[3])
{
    const kmp_ref turned = kmp_binary(g, KMP_OP_ATAN2, e[1], kmp_neg(e[0]));
    law_at(g, cam, kmp_add(g, turned, kmp_const(g, KMP_TURN / 2)), s);
}

/* The place of the base curve from which the follower's path is towards (x, y); for a flat face, whose normal is. */
static curve_place foot_of(kmp_graph *g, const kmp_cam_follower *follower, const kmp_ref towards[2])
{
    const kmp_cam *cam = follower->outline->cam;
    kmp_cam_check checked; /* by the reader */
    kmp_table *parts = kmp_cam_parameter(cam, follower, &checked);
    const int table = kmp_graph_add_table(g, parts);
    kmp_table_free(parts);
    kmp_ref u = table < 0 ? KMP_ONE : kmp_table_at(g, table, kmp_binary(g, KMP_OP_ATAN2, towards[1], towards[0]));
    curve_place at = curve_at(g, cam, u);
    for (int i = 0; i < KMP_CAM_STEPS; i++) {
        u = kmp_sub(g, u, step_from(g, follower, &at, towards));
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
    const curve_place at = foot_of(g, follower, c->at);
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
        const curve_place at = foot_of(g, follower, normal);
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
