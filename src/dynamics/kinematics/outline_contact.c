/* SPDX-License-Identifier: BSD-3-Clause */
/* A piece counts while the circle is between its borders, which are conditions: the distance jumps there to one at
 * which nothing touches, and the neighbour takes over with the same distance, normal and rates.
 *
 * Of n copies around the origin the nearest one is found without counting them. The circle has the angle p from the
 * middle of a copy. The sine and cosine of n p are a power of a complex number, and their angle within half a turn is n
 * times the angle from the middle of the nearest copy. The condition that the sine is negative joins its branches.
 *
 * A run of pieces is one contact. Its equations have the numbers of the piece that counts: tables of its index, which
 * follows from the conditions of the borders and is constant during a step. With u from the centre of an arc the
 * distance is n.x + s |u| - e, where a line has s = 0 and an arc n = 0. */
#include "dynamics/kinematics/outline_contact.h"
#include "constraints/tolerances.h"
#include "dynamics/kinematics/kinematics_conditions.h"
#include "dynamics/kinematics/kinematics_vectors.h"
#include "dynamics/kinematics/plane_vector.h"
#include "model/data/outline.h"
#include "model/language/dimension.h"
#include "symbolic/function_table.h"
#include "symbolic/table_function.h"
#include <math.h>
#include <string.h>

/* Conditions of a part. */
enum { PART_STANDS, PART_PASSES, PART_LEAVES_CORNER /* at the beginning; 1 more at the end */ };

/* 1 where a value is negative. Every change would fill the log: it is not noted. */
static kmp_ref stands(const kmp_tree *tree, const kmp_outline_part *part, const void *of, kmp_ref value, double lag,
                      const char *text)
{
    const kmp_ref holds =
        kmp_tree_condition(tree, of, PART_STANDS, value, lag, NULL, "contact '%s': %s", part->name, text);
    const int k = tree->conditions.events ? kmp_events_find(tree->conditions.events, of, PART_STANDS) : -1;
    if (k >= 0)
        tree->conditions.events->condition[k].silent = true;
    return holds;
}

/* A power of a complex number. */
static void power_of(kmp_graph *g, const kmp_ref of[2], int n, kmp_ref result[2])
{
    kmp_ref z[2] = {of[0], of[1]};
    result[0] = KMP_ONE;
    result[1] = KMP_ZERO;
    for (; n > 0; n /= 2) {
        if (n % 2)
            kmp_plane_turn(g, result, z, result);
        kmp_plane_turn(g, z, z, z);
    }
}

/* The place as it is at the first copy when the nearest one, or the second nearest, is turned there, if there are
 * copies. Returned: 1 where the second nearest one is the copy before the nearest one, 0 where it is the copy behind
 * it. */
static kmp_ref fold_place(const kmp_tree *tree, const kmp_outline_part *part, bool second,
                          const kmp_circle_place *place, kmp_ref at[2])
{
    kmp_graph *g = tree->graph;
    const kmp_outline_fold *fold = part->fold;
    memcpy(at, place->at.x, 2 * sizeof *at);
    if (!fold)
        return KMP_ZERO;
    const int n = fold->copies;
    const kmp_ref size = kmp_sqrt(g, kmp_plane_dot(g, at, at));
    const kmp_ref unit[2] = {kmp_div(g, at[0], size), kmp_div(g, at[1], size)};
    const kmp_ref back[2] = {kmp_const(g, cos(n * fold->middle)), kmp_const(g, -sin(n * fold->middle))};
    kmp_ref turned[2];
    power_of(g, unit, n, turned);
    kmp_plane_turn(g, turned, back, turned);
    const kmp_ref right = stands(tree, part, fold, turned[1], KMP_OUTLINE_FOLD_LAG, "nearest copy");
    const kmp_ref quarter = kmp_const(g, KMP_TURN / 4), one = kmp_const(g, 1.0 / n);
    const kmp_ref left_angle = kmp_add(g, quarter, kmp_binary(g, KMP_OP_ATAN2, kmp_neg(turned[0]), turned[1]));
    const kmp_ref right_angle = kmp_sub(g, kmp_binary(g, KMP_OP_ATAN2, turned[0], kmp_neg(turned[1])), quarter);
    kmp_ref angle = kmp_mul(g, one, kmp_select(g, right, right_angle, left_angle));
    if (second) {
        const kmp_ref step = kmp_const(g, KMP_TURN / n);
        angle = kmp_add(g, angle, kmp_select(g, right, step, kmp_neg(step)));
    }
    angle = kmp_add(g, angle, kmp_const(g, fold->middle));
    at[0] = kmp_mul(g, size, kmp_cos(g, angle));
    at[1] = kmp_mul(g, size, kmp_sin(g, angle));
    return right;
}

/* A vector at the folded place, turned back to the copy where the place is, times the square of the distance from the
 * origin. */
static void unfold(kmp_graph *g, const kmp_circle_place *place, const kmp_ref at[2], const kmp_ref v[2], kmp_ref out[2])
{
    const kmp_ref back[2] = {at[0], kmp_neg(at[1])};
    kmp_ref angle[2];
    kmp_plane_turn(g, place->at.x, back, angle);
    kmp_plane_turn(g, v, angle, out);
}

static kmp_ref along(kmp_graph *g, const double direction[2], const double from[2], const kmp_ref at[2])
{
    return kmp_add(g, kmp_mul(g, kmp_const(g, direction[0]), kmp_sub(g, at[0], kmp_const(g, from[0]))),
                   kmp_mul(g, kmp_const(g, direction[1]), kmp_sub(g, at[1], kmp_const(g, from[1]))));
}

static kmp_ref inverse(kmp_graph *g, kmp_ref condition)
{
    return kmp_sub(g, KMP_ONE, condition);
}

static kmp_ref is_beyond(const kmp_tree *tree, const kmp_outline_part *part, const kmp_outline_border *border,
                         const kmp_ref at[2])
{
    return stands(tree, part, border, kmp_neg(along(tree->graph, border->along, border->place, at)),
                  KMP_OUTLINE_LAG * part->away, "beyond an end");
}

/* 1 behind the border where the piece begins, otherwise 0. `place`: not folded. */
static kmp_ref begins(const kmp_tree *tree, const kmp_outline_part *part, const kmp_circle_place *place,
                      const kmp_ref at[2])
{
    kmp_graph *g = tree->graph;
    const kmp_ref own = is_beyond(tree, part, part->low, at);
    kmp_ref other_at[2];
    if (!part->fold || !part->before)
        return own;
    const kmp_ref before = fold_place(tree, part, !part->second, place, other_at);
    const kmp_ref other = is_beyond(tree, part, part->before->high[0], other_at);
    return part->second ? kmp_select(g, before, own, other) : kmp_select(g, before, other, own);
}

/* 1 where the solid of a sharp corner is on the free side of the line that it touches, otherwise 0. So a block
 * slides over the edge of a table without striking it. */
static kmp_ref faces(const kmp_tree *tree, const kmp_outline_part *part, const kmp_circle_place *place,
                     const kmp_ref at[2])
{
    kmp_graph *g = tree->graph;
    kmp_ref out[2] = {kmp_const(g, part->piece.normal[0]), kmp_const(g, part->piece.normal[1])}, rise[2];
    if (part->fold)
        unfold(g, place, at, out, out);
    for (int k = 0; k < 2; k++)
        rise[k] = kmp_plane_dot(g, out, place->edge[k]);
    kmp_ref least = kmp_binary(g, KMP_OP_MIN, rise[0], rise[1]);
    if (part->fold)
        least = kmp_div(g, least, kmp_plane_dot(g, at, at));
    return inverse(g, stands(tree, part, part->edge, kmp_add(g, least, kmp_const(g, KMP_OUTLINE_FACES)),
                             KMP_OUTLINE_FOLD_LAG, "the corner turns away"));
}

/* 1 between the borders, otherwise 0. */
static kmp_ref between(const kmp_tree *tree, const kmp_outline_part *part, const kmp_circle_place *place,
                       const kmp_ref at[2])
{
    kmp_graph *g = tree->graph;
    kmp_ref within = KMP_ONE;
    if (part->low && part->high[0]) {
        const kmp_ref low = begins(tree, part, place, at);
        const kmp_ref high = inverse(g, is_beyond(tree, part, part->high[0], at));
        within = part->either ? inverse(g, kmp_mul(g, inverse(g, low), inverse(g, high))) : kmp_mul(g, low, high);
    }
    for (int k = 1; k < 3; k++)
        if (part->high[k])
            within = kmp_mul(g, within, inverse(g, is_beyond(tree, part, part->high[k], at)));
    return part->meets_corner ? kmp_mul(g, within, faces(tree, part, place, at)) : within;
}

/* The distance of the place from the curve, positive on the free side. */
static kmp_ref height_of(kmp_graph *g, const kmp_piece *piece, const kmp_ref at[2])
{
    kmp_ref u[2];
    if (!piece->arc)
        return along(g, piece->normal, piece->from, at);
    kmp_plane_from(g, piece->centre, at, u);
    const kmp_ref size = kmp_sqrt(g, kmp_plane_dot(g, u, u)), radius = kmp_const(g, piece->radius);
    return piece->turn < 0 ? kmp_sub(g, radius, size) : kmp_sub(g, size, radius);
}

/* -- runs ---------------------------------------------------------------------------------------------- */

/* Numbers of a piece, by which the pieces of a run differ. */
enum {
    COLUMN_NORMAL_X,
    COLUMN_NORMAL_Y,
    COLUMN_ROUND, /* 1 for an arc, 0 for a line */
    COLUMN_CENTRE_X,
    COLUMN_CENTRE_Y,
    COLUMN_HEIGHT, /* n.x of a line, the radius of an arc */
    COLUMN_COUNTS,
    COLUMN_INSIDE,
    COLUMN_RADIUS, /* of an arc; 0 for a line */
    COLUMN_OUT_X,  /* from the centre to the middle of an arc */
    COLUMN_OUT_Y,
    COLUMN_WAY,   /* of the circle along the run, where the way along the piece is 0 */
    COLUMN_ANGLE, /* likewise, the angle by which it has turned there */
    COLUMNS
};

typedef struct run_row {
    double at[COLUMNS];
} run_row;

/* The pieces of a run: row 0 is of none, with the numbers of the first one. */
typedef struct run {
    kmp_graph *g;
    int count;
    run_row *row;
    double length, angle; /* of the whole */
    kmp_ref index;        /* of the piece that counts, from 1; 0: none does */
    kmp_ref n[2], u[2];   /* of that piece: the normal of a line; the vector from the centre */
} run;

/* The numbers of a piece; *length and *angle: of the run before it, then with it. */
static void put_row(const kmp_outline_part *part, double *row, double *length, double *angle)
{
    const kmp_piece *piece = &part->piece;
    double middle[2], normal[2], along[2];
    row[COLUMN_COUNTS] = 1;
    row[COLUMN_INSIDE] = KMP_OUTLINE_INSIDE * fmin(part->depth, part->away);
    if (piece->arc) {
        kmp_piece_place(piece, 0.5, middle, normal);
        row[COLUMN_ROUND] = 1;
        row[COLUMN_CENTRE_X] = piece->centre[0];
        row[COLUMN_CENTRE_Y] = piece->centre[1];
        row[COLUMN_HEIGHT] = row[COLUMN_RADIUS] = piece->radius;
        row[COLUMN_OUT_X] = normal[0];
        row[COLUMN_OUT_Y] = normal[1];
        row[COLUMN_WAY] = *length + piece->radius * piece->turn / 2;
        row[COLUMN_ANGLE] = *angle + piece->turn / 2;
        *length += piece->radius * piece->turn;
        *angle += piece->turn;
        return;
    }
    kmp_piece_tangent(piece, false, along);
    row[COLUMN_NORMAL_X] = piece->normal[0];
    row[COLUMN_NORMAL_Y] = piece->normal[1];
    row[COLUMN_HEIGHT] = piece->normal[0] * piece->from[0] + piece->normal[1] * piece->from[1];
    for (int i = 0; i < 2; i++) /* any place behind the line, away from all circles on it */
        row[COLUMN_CENTRE_X + i] = piece->from[i] - part->away * piece->normal[i];
    row[COLUMN_OUT_X] = 1;
    row[COLUMN_WAY] = *length - along[0] * piece->from[0] - along[1] * piece->from[1];
    row[COLUMN_ANGLE] = *angle;
    *length += hypot(piece->to[0] - piece->from[0], piece->to[1] - piece->from[1]);
}

/* A number of the piece that counts. */
static kmp_ref number_of(const run *r, int column)
{
    bool equal = true;
    double *x = KMP_GRAPH_NEW(r->g, double, 2 * (r->count + 2));
    if (!x || !r->row)
        return KMP_ZERO;
    double *y = x + r->count + 2;
    for (int k = 0; k < r->count + 2; k++) {
        x[k] = k;
        y[k] = r->row[k <= r->count ? k : 0].at[column]; /* the last one is not an index: it ends the last line */
        equal = equal && y[k] == y[0];
    }
    kmp_table *table = equal ? NULL : kmp_table_new(KMP_TABLE_LINEAR, r->count + 2, x, y);
    const int number = table ? kmp_graph_add_table(r->g, table) : -1;
    kmp_table_free(table);
    return equal ? kmp_const(r->g, y[0]) : number < 0 ? KMP_ZERO : kmp_table_at(r->g, number, r->index);
}

/* 1 where the circle is before half of the solid behind a piece. */
static kmp_ref is_outside(const kmp_tree *tree, const kmp_outline_part *part, kmp_ref within, kmp_ref height)
{
    kmp_graph *g = tree->graph;
    if (!(part->depth < INFINITY))
        return KMP_ONE;
    const kmp_ref reach = kmp_add(g, height, kmp_const(g, KMP_OUTLINE_OTHER_SIDE * part->depth));
    const kmp_ref deep = kmp_select(g, within, reach, KMP_ONE);
    return inverse(g, stands(tree, part, part, deep, 0, "on the other side of the solid"));
}

static void end_inside(const kmp_tree *tree, const kmp_outline_part *part, kmp_ref within, kmp_ref left)
{
    kmp_tree_end(tree, part, PART_PASSES, kmp_select(tree->graph, within, left, KMP_ONE),
                 "it was not stopped at the surface: take smaller steps ('max_step'), or start outside",
                 "contact '%s' is inside the solid by half of its thickness", part->name);
}

/* Runs end where a circle presses on both sides of a hollow corner and one of them counts no more: beyond its border,
 * before the surface of the circle leaves the piece, and as near to the corner as there are only its sides. */
static void end_in_corner(const kmp_tree *tree, const kmp_outline_part *part, bool at_end, const kmp_ref at[2],
                          kmp_ref gap)
{
    kmp_graph *g = tree->graph;
    const double *corner = at_end ? part->piece.to : part->piece.from, reach = part->reach[at_end];
    double out[2];
    kmp_piece_tangent(&part->piece, at_end, out);
    for (int i = 0; i < 2 && !at_end; i++)
        out[i] = -out[i];
    kmp_ref d[2];
    kmp_plane_from(g, corner, at, d);
    const kmp_ref beyond = kmp_sub(g, kmp_const(g, reach), along(g, out, corner, at)), square = kmp_plane_dot(g, d, d);
    const kmp_ref near = kmp_sub(g, kmp_mul(g, kmp_const(g, 1 / (4 * reach)), square), kmp_const(g, reach));
    kmp_tree_end(tree, part, PART_LEAVES_CORNER + at_end,
                 kmp_binary(g, KMP_OP_MAX, beyond, kmp_binary(g, KMP_OP_MAX, gap, near)),
                 "beyond it one of both sides would be lost: take a stiffer law",
                 "contact '%s' is deeper behind a hollow corner than half of the way to the next piece", part->name);
}

static run run_of(const kmp_tree *tree, const kmp_outline_part *first, const kmp_circle_place *place,
                  const kmp_ref at[2])
{
    kmp_graph *g = tree->graph;
    run r = {.g = g, .index = KMP_ZERO};
    for (const kmp_outline_part *part = first; part; part = part->next)
        r.count++;
    r.row = KMP_GRAPH_NEW(g, run_row, r.count + 1);
    int k = 1;
    for (const kmp_outline_part *part = first; r.row && part; part = part->next, k++) {
        put_row(part, r.row[k].at, &r.length, &r.angle);
        const kmp_ref within = between(tree, part, place, at);
        const kmp_ref outside = is_outside(tree, part, within, height_of(g, &part->piece, at));
        r.index = kmp_select(g, kmp_mul(g, within, outside), kmp_const(g, k), r.index);
    }
    if (r.row) {
        r.row[0] = r.row[1];
        r.row[0].at[COLUMN_COUNTS] = 0;
    }
    for (int i = 0; i < 2; i++) {
        r.n[i] = number_of(&r, COLUMN_NORMAL_X + i);
        r.u[i] = kmp_sub(g, at[i], number_of(&r, COLUMN_CENTRE_X + i));
    }
    return r;
}

static kmp_ref run_gap(const kmp_tree *tree, const kmp_outline_part *first, const kmp_circle_place *place,
                       const kmp_ref at[2], kmp_ref radius)
{
    kmp_graph *g = tree->graph;
    const run r = run_of(tree, first, place, at);
    const kmp_ref counts = number_of(&r, COLUMN_COUNTS), size = kmp_sqrt(g, kmp_plane_dot(g, r.u, r.u));
    const kmp_ref around = kmp_mul(g, number_of(&r, COLUMN_ROUND), size);
    const kmp_ref height = kmp_sub(g, kmp_add(g, kmp_plane_dot(g, r.n, at), around), number_of(&r, COLUMN_HEIGHT));
    end_inside(tree, first, counts, kmp_add(g, height, number_of(&r, COLUMN_INSIDE)));
    return kmp_select(g, counts, kmp_sub(g, height, radius), kmp_const(g, first->away));
}

/* The circle goes as its centre does: by the length of lines, and by (R + r) times the turn of arcs. */
static kmp_ref run_way(const kmp_tree *tree, const kmp_outline_part *first, const kmp_circle_place *place,
                       kmp_ref radius, kmp_ref *turn)
{
    kmp_graph *g = tree->graph;
    kmp_ref at[2];
    (void)fold_place(tree, first, first->second, place, at);
    const run r = run_of(tree, first, place, at);
    const kmp_ref o[2] = {number_of(&r, COLUMN_OUT_X), number_of(&r, COLUMN_OUT_Y)};
    const kmp_ref reach = kmp_add(g, number_of(&r, COLUMN_RADIUS), kmp_mul(g, number_of(&r, COLUMN_ROUND), radius));
    const kmp_ref angle = kmp_binary(g, KMP_OP_ATAN2, kmp_plane_cross(g, o, r.u), kmp_plane_dot(g, o, r.u));
    const kmp_ref around = kmp_mul(g, reach, angle);
    const kmp_ref begins = kmp_add(g, number_of(&r, COLUMN_WAY), kmp_mul(g, radius, number_of(&r, COLUMN_ANGLE)));
    if (r.angle > KMP_TURN * (1 - KMP_WRITTEN_DIGITS)) /* all round a closed shape */
        *turn = kmp_add(g, kmp_const(g, r.length / KMP_TURN), radius);
    return kmp_add(g, kmp_add(g, kmp_plane_cross(g, r.n, at), around), begins);
}

/* -- contacts ------------------------------------------------------------------------------------------ */

kmp_ref kmp_outline_gap(const kmp_tree *tree, const kmp_contact_pair *touch, const kmp_circle_place *place,
                        kmp_ref radius)
{
    kmp_graph *g = tree->graph;
    const kmp_outline_part *part = touch->side[1].piece;
    kmp_ref at[2];
    (void)fold_place(tree, part, part->second, place, at);
    if (part->next)
        return run_gap(tree, part, place, at, radius);
    const kmp_ref height = height_of(g, &part->piece, at);
    const kmp_ref between_ends = between(tree, part, place, at);
    const kmp_ref within = kmp_mul(g, between_ends, is_outside(tree, part, between_ends, height));
    if (part->depth < INFINITY)
        end_inside(tree, part, within, kmp_add(g, height, kmp_const(g, KMP_OUTLINE_INSIDE * part->depth)));
    for (int end = 0; end < 2; end++)
        if (part->reach[end] > 0)
            end_in_corner(tree, part, end, at, kmp_sub(g, height, radius));
    return kmp_select(g, within, kmp_sub(g, height, radius), kmp_const(g, part->away));
}

/* The gradient of the height of a piece, or of a run. */
static void piece_normal(kmp_graph *g, const kmp_piece *piece, const kmp_ref at[2], kmp_ref normal[2])
{
    for (int i = 0; i < 2; i++)
        normal[i] = kmp_const(g, piece->normal[i]);
    if (!piece->arc)
        return;
    kmp_ref u[2];
    kmp_plane_from(g, piece->centre, at, u);
    const kmp_ref size = kmp_sqrt(g, kmp_plane_dot(g, u, u));
    const kmp_ref over = kmp_div(g, kmp_const(g, piece->turn < 0 ? -1 : 1), size);
    for (int i = 0; i < 2; i++)
        normal[i] = kmp_mul(g, over, u[i]);
}

static void run_normal(const kmp_tree *tree, const kmp_outline_part *first, const kmp_circle_place *place,
                       const kmp_ref at[2], kmp_ref normal[2])
{
    kmp_graph *g = tree->graph;
    const run r = run_of(tree, first, place, at);
    const kmp_ref size = kmp_sqrt(g, kmp_plane_dot(g, r.u, r.u));
    const kmp_ref over = kmp_div(g, number_of(&r, COLUMN_ROUND), size);
    for (int i = 0; i < 2; i++)
        normal[i] = kmp_add(g, r.n[i], kmp_mul(g, over, r.u[i]));
}

void kmp_outline_normal(const kmp_tree *tree, const kmp_contact_pair *touch, const kmp_circle_place *place,
                        kmp_ref normal[2])
{
    kmp_graph *g = tree->graph;
    const kmp_outline_part *part = touch->side[1].piece;
    kmp_ref at[2];
    (void)fold_place(tree, part, part->second, place, at);
    if (part->next)
        run_normal(tree, part, place, at, normal);
    else
        piece_normal(g, &part->piece, at, normal);
    if (!part->fold)
        return;
    const kmp_ref square = kmp_plane_dot(g, at, at);
    unfold(g, place, at, normal, normal);
    for (int i = 0; i < 2; i++)
        normal[i] = kmp_div(g, normal[i], square);
}

/* Of a circle about a place: the length along a line, or the angle from the middle of an arc, which starts again on the
 * other side, and the distance from the arc's centre. */
static kmp_ref around(const kmp_tree *tree, const kmp_outline_part *part, const kmp_circle_place *place,
                      kmp_ref *distance)
{
    kmp_graph *g = tree->graph;
    const kmp_piece *piece = &part->piece;
    kmp_ref at[2];
    double middle[2], normal[2];
    (void)fold_place(tree, part, part->second, place, at);
    kmp_piece_tangent(piece, false, middle);
    if (!piece->arc)
        return along(g, middle, piece->from, at);
    kmp_piece_place(piece, 0.5, middle, normal);
    const double sign = piece->turn < 0 ? -1 : 1, out[2] = {sign * normal[0], sign * normal[1]};
    const double left[2] = {-out[1], out[0]};
    const kmp_ref sine = along(g, left, piece->centre, at), cosine = along(g, out, piece->centre, at);
    *distance = kmp_sqrt(g, kmp_add(g, kmp_mul(g, sine, sine), kmp_mul(g, cosine, cosine)));
    return kmp_binary(g, KMP_OP_ATAN2, sine, cosine);
}

kmp_ref kmp_outline_way(const kmp_tree *tree, const kmp_contact_pair *touch, const kmp_circle_place *place,
                        kmp_ref radius, kmp_ref rolled, kmp_ref *turn)
{
    kmp_graph *g = tree->graph;
    const kmp_outline_part *part = touch->side[1].piece;
    const kmp_piece *piece = &part->piece;
    *turn = KMP_ZERO;
    if (part->next)
        return kmp_sub(g, run_way(tree, part, place, radius, turn), rolled);
    kmp_ref unused, passed = around(tree, part, place, &unused);
    if (!piece->arc)
        return kmp_sub(g, passed, rolled);
    const kmp_ref r = kmp_const(g, piece->radius);
    const kmp_ref reach = piece->turn < 0 ? kmp_sub(g, radius, r) : kmp_add(g, radius, r);
    if (fabs(piece->turn) >= KMP_TURN)
        *turn = reach;
    return kmp_sub(g, kmp_mul(g, reach, passed), rolled);
}

kmp_ref kmp_outline_slip(const kmp_tree *tree, const kmp_contact_pair *touch, const kmp_circle_place *place,
                         kmp_ref radius, kmp_ref rolled)
{
    kmp_graph *g = tree->graph;
    const kmp_outline_part *part = touch->side[1].piece;
    const kmp_piece *piece = &part->piece;
    kmp_ref distance, turn;
    if (part->next) { /* rigid: the circle is nowhere deep */
        const kmp_ref way = kmp_outline_way(tree, touch, place, radius, rolled, &turn);
        return kmp_vec_rate(tree, (kmp_vec){{way, KMP_ZERO, KMP_ZERO}}).x[0];
    }
    const kmp_ref passed = around(tree, part, place, &distance);
    const kmp_vec rate = kmp_vec_rate(tree, (kmp_vec){{passed, rolled, KMP_ZERO}});
    const kmp_ref moved = piece->arc ? kmp_mul(g, distance, rate.x[0]) : rate.x[0];
    return kmp_sub(g, piece->arc && piece->turn < 0 ? kmp_neg(moved) : moved, rate.x[1]);
}
