/* SPDX-License-Identifier: BSD-3-Clause */
/* With (x, y) from the centre of the cam to a roller in the axes of the cam, r its length and a its angle, the centre
 * of the roller is on r = p(a). The distance is (r - p) p/sqrt(p^2 + p'^2): exact on the path, with its derivatives
 * there. Of the law of a follower with an offset, or on a lever, the path is its place f(s(u)) turned by u. The
 * place of the roller gives the lift that it would have and u; their difference from the law, times the normal part of
 * df/ds, is the distance. A face with the normal m at the angle b has the distance (x, y).m - h(b), with the support
 * function h. */
#include "dynamics/kinematics/cam_contact.h"
#include "dynamics/kinematics/kinematics_vectors.h"
#include "model/data/model.h"
#include "model/data/outline.h"
#include "symbolic/derivative.h"
#include "symbolic/function_table.h"
#include <math.h>

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

/* The path of a follower at an angle with this cosine and sine, times any length: its distance and two derivatives. */
static void path_at(kmp_graph *g, const kmp_cam_follower *follower, kmp_ref x, kmp_ref y, kmp_ref p[3])
{
    const kmp_cam *cam = follower->outline->cam;
    if (kmp_cam_is_exact(cam, follower)) {
        const kmp_ref turned = kmp_binary(g, KMP_OP_ATAN2, y, kmp_neg(x));
        const kmp_ref angle = kmp_add(g, turned, kmp_const(g, KMP_TURN / 2));
        p[0] = kmp_add(g, kmp_const(g, cam->base), lift_at(g, cam, 0, angle));
        p[1] = kmp_neg(lift_at(g, cam, 1, angle));
        p[2] = lift_at(g, cam, 2, angle);
        return;
    }
    kmp_table *path = kmp_cam_path(cam, follower);
    const int table = kmp_graph_add_table(g, path);
    const kmp_ref angle = kmp_binary(g, KMP_OP_ATAN2, y, x);
    kmp_table_free(path);
    for (int d = 0; d < 3; d++)
        p[d] = table < 0 ? KMP_ONE
               : d == 0  ? kmp_table_at(g, table, angle)
                         : kmp_table_derivative_at(g, table, d, angle);
}

/* -- followers ------------------------------------------------------------------------------------------------ */

/* The cam's axes x and y, the vector from its centre to the follower's point in the frame and in these axes. */
typedef struct cam_place {
    kmp_graph *g;
    kmp_vec axes[3], d;
    kmp_ref x, y;
} cam_place;

static kmp_vec combined(const cam_place *c, kmp_ref x, kmp_ref y)
{
    return kmp_vec_add(c->g, kmp_vec_scale(c->g, x, c->axes[0]), kmp_vec_scale(c->g, y, c->axes[1]));
}

/* A circle about another centre than the origin of the outline. */
static void roll_on_circle(const cam_place *c, const kmp_cam_follower *follower, kmp_cam_contact *out)
{
    kmp_graph *g = c->g;
    const kmp_piece *circle = &follower->outline->pieces[0];
    const kmp_ref x = kmp_sub(g, c->x, kmp_const(g, circle->centre[0]));
    const kmp_ref y = kmp_sub(g, c->y, kmp_const(g, circle->centre[1]));
    const kmp_ref r = kmp_sqrt(g, kmp_add(g, kmp_mul(g, x, x), kmp_mul(g, y, y)));
    out->gap = kmp_sub(g, r, kmp_const(g, circle->radius + follower->radius));
    const kmp_ref nx = kmp_div(g, x, r), ny = kmp_div(g, y, r);
    out->normal = combined(c, nx, ny);
    out->curvature = kmp_const(g, 1 / circle->radius);
}

/* The law's own roller with an offset, or on a lever. */
static void roll_beside(const cam_place *c, const kmp_cam_follower *follower, kmp_cam_contact *out)
{
    kmp_graph *g = c->g;
    const kmp_cam *cam = follower->outline->cam;
    const double side = copysign(1, cam->arm), l = fabs(cam->arm);
    const kmp_ref square = kmp_add(g, kmp_mul(g, c->x, c->x), kmp_mul(g, c->y, c->y));
    kmp_ref f[2], by[2] = {KMP_ONE, KMP_ZERO}, bend[2] = {KMP_ZERO, KMP_ZERO}, lift;
    if (cam->arm != 0) { /* the triangle of bearing, centre and roller */
        const kmp_ref rest = kmp_sub(g, kmp_const(g, cam->pivot * cam->pivot + l * l), square);
        const kmp_ref cosine = kmp_mul(g, kmp_const(g, 1 / (2 * cam->pivot * l)), rest);
        const kmp_ref sine = kmp_sqrt(g, kmp_sub(g, KMP_ONE, kmp_mul(g, cosine, cosine)));
        lift = kmp_binary(g, KMP_OP_ATAN2, sine, cosine);
        by[0] = kmp_mul(g, kmp_const(g, l), sine);
        by[1] = kmp_mul(g, kmp_const(g, side * l), cosine);
        bend[0] = kmp_mul(g, kmp_const(g, l), cosine);
        bend[1] = kmp_mul(g, kmp_const(g, -side * l), sine);
        f[0] = kmp_sub(g, kmp_const(g, cam->pivot), bend[0]);
        f[1] = kmp_neg(bend[1]);
    } else {
        lift = f[0] = kmp_sqrt(g, kmp_sub(g, square, kmp_const(g, cam->offset * cam->offset)));
        f[1] = kmp_const(g, -cam->offset);
    }
    /* x axis of f: the place is f[0] of it and f[1] of the axis across */
    const kmp_ref ex = kmp_div(g, kmp_add(g, kmp_mul(g, f[0], c->x), kmp_mul(g, f[1], c->y)), square);
    const kmp_ref ey = kmp_div(g, kmp_sub(g, kmp_mul(g, f[0], c->y), kmp_mul(g, f[1], c->x)), square);
    const kmp_ref angle = kmp_add(g, kmp_binary(g, KMP_OP_ATAN2, ey, kmp_neg(ex)), kmp_const(g, KMP_TURN / 2));
    const kmp_ref s = kmp_add(g, kmp_const(g, cam->base), lift_at(g, cam, 0, angle));
    const kmp_ref s1 = kmp_neg(lift_at(g, cam, 1, angle)), s2 = lift_at(g, cam, 2, angle);
    kmp_ref f1[2], f2[2];
    for (int i = 0; i < 2; i++) {
        f1[i] = kmp_mul(g, s1, by[i]);
        f2[i] = kmp_add(g, kmp_mul(g, s2, by[i]), kmp_mul(g, kmp_mul(g, s1, s1), bend[i]));
    }
    const kmp_ref gx = kmp_sub(g, f1[0], f[1]), gy = kmp_add(g, f1[1], f[0]);
    const kmp_ref hx = kmp_sub(g, f2[0], kmp_add(g, kmp_add(g, f1[1], f1[1]), f[0]));
    const kmp_ref hy = kmp_sub(g, kmp_add(g, f2[1], kmp_add(g, f1[0], f1[0])), f[1]);
    const kmp_ref size_square = kmp_add(g, kmp_mul(g, gx, gx), kmp_mul(g, gy, gy)), size = kmp_sqrt(g, size_square);
    const kmp_ref nx = kmp_div(g, gy, size), ny = kmp_neg(kmp_div(g, gx, size));
    const kmp_ref part = kmp_add(g, kmp_mul(g, nx, by[0]), kmp_mul(g, ny, by[1]));
    out->gap = kmp_mul(g, kmp_sub(g, lift, s), part);
    const kmp_ref along = kmp_sub(g, kmp_mul(g, nx, ex), kmp_mul(g, ny, ey));
    const kmp_ref across = kmp_add(g, kmp_mul(g, nx, ey), kmp_mul(g, ny, ex));
    out->normal = combined(c, along, across);
    const kmp_ref cross = kmp_sub(g, kmp_mul(g, gx, hy), kmp_mul(g, gy, hx));
    const kmp_ref of_path = kmp_div(g, cross, kmp_mul(g, size_square, size));
    out->curvature = kmp_div(g, of_path, kmp_sub(g, KMP_ONE, kmp_mul(g, kmp_const(g, follower->radius), of_path)));
}

static void roll_on_path(const cam_place *c, const kmp_cam_follower *follower, kmp_cam_contact *out)
{
    kmp_graph *g = c->g;
    kmp_ref p[3];
    path_at(g, follower, c->x, c->y, p);
    const kmp_ref r = kmp_sqrt(g, kmp_add(g, kmp_mul(g, c->x, c->x), kmp_mul(g, c->y, c->y)));
    const kmp_ref square = kmp_add(g, kmp_mul(g, p[0], p[0]), kmp_mul(g, p[1], p[1])), size = kmp_sqrt(g, square);
    out->gap = kmp_mul(g, kmp_sub(g, r, p[0]), kmp_div(g, p[0], size));
    /* n = (p e - p' e')/size with e = (x, y)/r, e' = (-y, x)/r */
    const kmp_ref along = kmp_div(g, p[0], kmp_mul(g, r, size)), back = kmp_div(g, p[1], kmp_mul(g, r, size));
    const kmp_ref nx = kmp_add(g, kmp_mul(g, along, c->x), kmp_mul(g, back, c->y));
    const kmp_ref ny = kmp_sub(g, kmp_mul(g, along, c->y), kmp_mul(g, back, c->x));
    out->normal = combined(c, nx, ny);
    /* of the path (p^2 + 2 p'^2 - p p'')/size^3; of the profile, which is parallel to it */
    const kmp_ref twice = kmp_mul(g, kmp_const(g, 2), kmp_mul(g, p[1], p[1]));
    const kmp_ref of_path = kmp_div(g, kmp_sub(g, kmp_add(g, kmp_mul(g, p[0], p[0]), twice), kmp_mul(g, p[0], p[2])),
                                    kmp_mul(g, square, size));
    out->curvature = kmp_div(g, of_path, kmp_sub(g, KMP_ONE, kmp_mul(g, kmp_const(g, follower->radius), of_path)));
}

/* The face with the normal m touches at h m + h' t, with t across m. */
static void lie_on_profile(const cam_place *c, const kmp_cam_follower *follower, kmp_vec m, kmp_cam_contact *out)
{
    kmp_graph *g = c->g;
    const kmp_ref x = kmp_vec_dot(g, m, c->axes[0]), y = kmp_vec_dot(g, m, c->axes[1]);
    kmp_ref h[3], height, along;
    if (follower->outline->cam) {
        path_at(g, follower, x, y, h);
        height = h[0];
        along = h[1];
        out->curvature = kmp_div(g, KMP_ONE, kmp_add(g, h[0], h[2]));
    } else {
        const kmp_piece *circle = &follower->outline->pieces[0];
        const kmp_ref cx = kmp_const(g, circle->centre[0]), cy = kmp_const(g, circle->centre[1]);
        height = kmp_add(g, kmp_const(g, circle->radius), kmp_add(g, kmp_mul(g, cx, x), kmp_mul(g, cy, y)));
        along = kmp_sub(g, kmp_mul(g, cy, x), kmp_mul(g, cx, y));
        out->curvature = kmp_const(g, 1 / circle->radius);
    }
    out->normal = m;
    out->gap = kmp_sub(g, kmp_add(g, kmp_mul(g, c->x, x), kmp_mul(g, c->y, y)), height);
    const kmp_vec t = combined(c, kmp_neg(y), x);
    /* back to the face from the place on the cam, where they are apart */
    const kmp_ref beside = kmp_sub(g, along, kmp_sub(g, kmp_mul(g, c->y, x), kmp_mul(g, c->x, y)));
    out->arm = kmp_vec_scale(g, beside, t);
}

void kmp_cam_contact_find(const kmp_tree *tree, const kmp_cam_follower *follower, const int point[2],
                          const double face[3], kmp_cam_contact *contact)
{
    kmp_graph *g = tree->graph;
    cam_place c = {.g = g};
    c.d = kmp_point_difference(tree, point[0], point[1], &contact->frame);
    kmp_point_axes(tree, point[0], contact->frame, c.axes);
    c.x = kmp_vec_dot(g, c.axes[0], c.d);
    c.y = kmp_vec_dot(g, c.axes[1], c.d);
    contact->axis = c.axes[2];
    if (follower->form == KMP_FOLLOWER_FLAT) {
        lie_on_profile(&c, follower, kmp_point_direction(tree, point[1], face, contact->frame), contact);
        return;
    }
    if (follower->outline->cam && kmp_cam_is_beside(follower->outline->cam) &&
        kmp_cam_is_exact(follower->outline->cam, follower))
        roll_beside(&c, follower, contact);
    else if (follower->outline->cam)
        roll_on_path(&c, follower, contact);
    else
        roll_on_circle(&c, follower, contact);
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
