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

typedef struct complex_ref {
    kmp_ref re, im;
} complex_ref;

static complex_ref times(kmp_graph *g, complex_ref a, complex_ref b)
{
    return (complex_ref){kmp_sub(g, kmp_mul(g, a.re, b.re), kmp_mul(g, a.im, b.im)),
                         kmp_add(g, kmp_mul(g, a.re, b.im), kmp_mul(g, a.im, b.re))};
}

static complex_ref power_of(kmp_graph *g, complex_ref z, int n)
{
    complex_ref result = {KMP_ONE, KMP_ZERO};
    for (; n > 0; n /= 2) {
        if (n % 2)
            result = times(g, result, z);
        z = times(g, z, z);
    }
    return result;
}

/* The place as it is at the first copy when the nearest one, or the second nearest, is turned there, if there are
 * copies. Returned: 1 where the second nearest one is the copy before the nearest one, 0 where it is the copy behind
 * it. */
static kmp_ref fold_place(const kmp_tree *tree, const kmp_outline_part *part, bool second, kmp_ref *x, kmp_ref *y)
{
    kmp_graph *g = tree->graph;
    const kmp_outline_fold *fold = part->fold;
    if (!fold)
        return KMP_ZERO;
    const int n = fold->copies;
    const kmp_ref size = kmp_sqrt(g, kmp_add(g, kmp_mul(g, *x, *x), kmp_mul(g, *y, *y)));
    const complex_ref unit = {kmp_div(g, *x, size), kmp_div(g, *y, size)};
    const complex_ref back = {kmp_const(g, cos(n * fold->middle)), kmp_const(g, -sin(n * fold->middle))};
    const complex_ref turned = times(g, power_of(g, unit, n), back);
    const kmp_ref right = stands(tree, part, fold, turned.im, KMP_OUTLINE_FOLD_LAG, "nearest copy");
    const kmp_ref quarter = kmp_const(g, KMP_TURN / 4), one = kmp_const(g, 1.0 / n);
    const kmp_ref left_angle = kmp_add(g, quarter, kmp_binary(g, KMP_OP_ATAN2, kmp_neg(turned.re), turned.im));
    const kmp_ref right_angle = kmp_sub(g, kmp_binary(g, KMP_OP_ATAN2, turned.re, kmp_neg(turned.im)), quarter);
    kmp_ref angle = kmp_mul(g, one, kmp_select(g, right, right_angle, left_angle));
    if (second) {
        const kmp_ref step = kmp_const(g, KMP_TURN / n);
        angle = kmp_add(g, angle, kmp_select(g, right, step, kmp_neg(step)));
    }
    angle = kmp_add(g, angle, kmp_const(g, fold->middle));
    *x = kmp_mul(g, size, kmp_cos(g, angle));
    *y = kmp_mul(g, size, kmp_sin(g, angle));
    return right;
}

static kmp_ref along(kmp_graph *g, const double direction[2], const double from[2], kmp_ref x, kmp_ref y)
{
    return kmp_add(g, kmp_mul(g, kmp_const(g, direction[0]), kmp_sub(g, x, kmp_const(g, from[0]))),
                   kmp_mul(g, kmp_const(g, direction[1]), kmp_sub(g, y, kmp_const(g, from[1]))));
}

static kmp_ref inverse(kmp_graph *g, kmp_ref condition)
{
    return kmp_sub(g, KMP_ONE, condition);
}

static kmp_ref is_beyond(const kmp_tree *tree, const kmp_outline_part *part, const kmp_outline_border *border,
                         kmp_ref x, kmp_ref y)
{
    kmp_graph *g = tree->graph;
    return stands(tree, part, border, kmp_neg(along(g, border->along, border->place, x, y)),
                  KMP_OUTLINE_LAG * part->away, "beyond an end");
}

/* 1 behind the border where the piece begins, otherwise 0. `place`: not folded. */
static kmp_ref begins(const kmp_tree *tree, const kmp_outline_part *part, const kmp_circle_place *place, kmp_ref x,
                      kmp_ref y)
{
    kmp_graph *g = tree->graph;
    const kmp_ref own = is_beyond(tree, part, part->low, x, y);
    kmp_ref other_x = place->at.x[0], other_y = place->at.x[1];
    if (!part->fold || !part->before)
        return own;
    const kmp_ref before = fold_place(tree, part, !part->second, &other_x, &other_y);
    const kmp_ref other = is_beyond(tree, part, part->before->high[0], other_x, other_y);
    return part->second ? kmp_select(g, before, own, other) : kmp_select(g, before, other, own);
}

/* 1 where the solid of a sharp corner is on the free side of the line that it touches, otherwise 0. So a block
 * slides over the edge of a table without striking it. */
static kmp_ref faces(const kmp_tree *tree, const kmp_outline_part *part, const kmp_circle_place *place, kmp_ref x,
                     kmp_ref y)
{
    kmp_graph *g = tree->graph;
    const complex_ref normal = {kmp_const(g, part->piece.normal[0]), kmp_const(g, part->piece.normal[1])};
    complex_ref out = normal;
    if (part->fold) { /* turned back to the copy, times the square of the distance from the origin */
        const complex_ref own = {place->at.x[0], place->at.x[1]}, back = {x, kmp_neg(y)};
        out = times(g, normal, times(g, own, back));
    }
    kmp_ref rise[2];
    for (int k = 0; k < 2; k++)
        rise[k] = kmp_add(g, kmp_mul(g, out.re, place->edge[k][0]), kmp_mul(g, out.im, place->edge[k][1]));
    kmp_ref least = kmp_binary(g, KMP_OP_MIN, rise[0], rise[1]);
    if (part->fold)
        least = kmp_div(g, least, kmp_add(g, kmp_mul(g, x, x), kmp_mul(g, y, y)));
    return inverse(g, stands(tree, part, part->edge, kmp_add(g, least, kmp_const(g, KMP_OUTLINE_FACES)),
                             KMP_OUTLINE_FOLD_LAG, "the corner turns away"));
}

/* 1 between the borders, otherwise 0. */
static kmp_ref between(const kmp_tree *tree, const kmp_outline_part *part, const kmp_circle_place *place, kmp_ref x,
                       kmp_ref y)
{
    kmp_graph *g = tree->graph;
    kmp_ref within = KMP_ONE;
    if (part->low && part->high[0]) {
        const kmp_ref low = begins(tree, part, place, x, y);
        const kmp_ref high = inverse(g, is_beyond(tree, part, part->high[0], x, y));
        within = part->either ? inverse(g, kmp_mul(g, inverse(g, low), inverse(g, high))) : kmp_mul(g, low, high);
    }
    for (int k = 1; k < 3; k++)
        if (part->high[k])
            within = kmp_mul(g, within, inverse(g, is_beyond(tree, part, part->high[k], x, y)));
    return part->meets_corner ? kmp_mul(g, within, faces(tree, part, place, x, y)) : within;
}

/* The distance of the place from the curve, positive on the free side. */
static kmp_ref height_of(kmp_graph *g, const kmp_piece *piece, kmp_ref x, kmp_ref y)
{
    if (!piece->arc)
        return along(g, piece->normal, piece->from, x, y);
    const kmp_ref dx = kmp_sub(g, x, kmp_const(g, piece->centre[0])),
                  dy = kmp_sub(g, y, kmp_const(g, piece->centre[1]));
    const kmp_ref size = kmp_sqrt(g, kmp_add(g, kmp_mul(g, dx, dx), kmp_mul(g, dy, dy)));
    const kmp_ref radius = kmp_const(g, piece->radius);
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
typedef struct run_rows {
    int count;
    run_row *row;
    double length, angle; /* of the whole */
} run_rows;

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

static run_rows rows_of(kmp_graph *g, const kmp_outline_part *first)
{
    run_rows rows = {0};
    for (const kmp_outline_part *part = first; part; part = part->next)
        rows.count++;
    rows.row = KMP_GRAPH_NEW(g, run_row, rows.count + 1);
    int k = 1;
    for (const kmp_outline_part *part = first; rows.row && part; part = part->next)
        put_row(part, rows.row[k++].at, &rows.length, &rows.angle);
    if (rows.row) {
        rows.row[0] = rows.row[1];
        rows.row[0].at[COLUMN_COUNTS] = 0;
    }
    return rows;
}

/* A number of the piece with an index, which is whole. */
static kmp_ref number_of(kmp_graph *g, const run_rows *rows, int column, kmp_ref index)
{
    bool equal = true;
    double *x = KMP_GRAPH_NEW(g, double, 2 * (rows->count + 2));
    if (!x || !rows->row)
        return KMP_ZERO;
    double *y = x + rows->count + 2;
    for (int k = 0; k < rows->count + 2; k++) {
        x[k] = k;
        y[k] = rows->row[k <= rows->count ? k : 0].at[column]; /* the last one is not an index: it ends the last line */
        equal = equal && y[k] == y[0];
    }
    kmp_table *table = equal ? NULL : kmp_table_new(KMP_TABLE_LINEAR, rows->count + 2, x, y);
    const int number = table ? kmp_graph_add_table(g, table) : -1;
    kmp_table_free(table);
    return equal ? kmp_const(g, y[0]) : number < 0 ? KMP_ZERO : kmp_table_at(g, number, index);
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
static void end_in_corner(const kmp_tree *tree, const kmp_outline_part *part, bool at_end, kmp_ref x, kmp_ref y,
                          kmp_ref gap)
{
    kmp_graph *g = tree->graph;
    const double *corner = at_end ? part->piece.to : part->piece.from, reach = part->reach[at_end];
    double out[2];
    kmp_piece_tangent(&part->piece, at_end, out);
    for (int i = 0; i < 2 && !at_end; i++)
        out[i] = -out[i];
    const kmp_ref dx = kmp_sub(g, x, kmp_const(g, corner[0])), dy = kmp_sub(g, y, kmp_const(g, corner[1]));
    const kmp_ref beyond = kmp_sub(g, kmp_const(g, reach), along(g, out, corner, x, y));
    const kmp_ref square = kmp_add(g, kmp_mul(g, dx, dx), kmp_mul(g, dy, dy));
    const kmp_ref near = kmp_sub(g, kmp_mul(g, kmp_const(g, 1 / (4 * reach)), square), kmp_const(g, reach));
    kmp_tree_end(tree, part, PART_LEAVES_CORNER + at_end,
                 kmp_binary(g, KMP_OP_MAX, beyond, kmp_binary(g, KMP_OP_MAX, gap, near)),
                 "beyond it one of both sides would be lost: take a stiffer law",
                 "contact '%s' is deeper behind a hollow corner than half of the way to the next piece", part->name);
}

/* The index of the piece that counts, from 1; 0: none does. */
static kmp_ref index_of(const kmp_tree *tree, const kmp_outline_part *first, const kmp_circle_place *place, kmp_ref x,
                        kmp_ref y)
{
    kmp_graph *g = tree->graph;
    kmp_ref index = KMP_ZERO;
    int k = 1;
    for (const kmp_outline_part *part = first; part; part = part->next, k++) {
        const kmp_ref within = between(tree, part, place, x, y);
        const kmp_ref outside = is_outside(tree, part, within, height_of(g, &part->piece, x, y));
        index = kmp_select(g, kmp_mul(g, within, outside), kmp_const(g, k), index);
    }
    return index;
}

/* The vector from the centre of the piece with an index. */
static void from_centre(kmp_graph *g, const run_rows *rows, kmp_ref index, kmp_ref x, kmp_ref y, kmp_ref u[2])
{
    u[0] = kmp_sub(g, x, number_of(g, rows, COLUMN_CENTRE_X, index));
    u[1] = kmp_sub(g, y, number_of(g, rows, COLUMN_CENTRE_Y, index));
}

static kmp_ref product_sum(kmp_graph *g, kmp_ref a, kmp_ref b, kmp_ref c, kmp_ref d)
{
    return kmp_add(g, kmp_mul(g, a, b), kmp_mul(g, c, d));
}

static kmp_ref run_gap(const kmp_tree *tree, const kmp_outline_part *first, const kmp_circle_place *place, kmp_ref x,
                       kmp_ref y, kmp_ref radius)
{
    kmp_graph *g = tree->graph;
    const run_rows rows = rows_of(g, first);
    const kmp_ref index = index_of(tree, first, place, x, y), counts = number_of(g, &rows, COLUMN_COUNTS, index);
    const kmp_ref nx = number_of(g, &rows, COLUMN_NORMAL_X, index), ny = number_of(g, &rows, COLUMN_NORMAL_Y, index);
    kmp_ref u[2];
    from_centre(g, &rows, index, x, y, u);
    const kmp_ref size = kmp_sqrt(g, product_sum(g, u[0], u[0], u[1], u[1]));
    const kmp_ref around = kmp_mul(g, number_of(g, &rows, COLUMN_ROUND, index), size);
    const kmp_ref height =
        kmp_sub(g, kmp_add(g, product_sum(g, nx, x, ny, y), around), number_of(g, &rows, COLUMN_HEIGHT, index));
    end_inside(tree, first, counts, kmp_add(g, height, number_of(g, &rows, COLUMN_INSIDE, index)));
    return kmp_select(g, counts, kmp_sub(g, height, radius), kmp_const(g, first->away));
}

/* The circle goes as its centre does: by the length of lines, and by (R + r) times the turn of arcs. */
static kmp_ref run_way(const kmp_tree *tree, const kmp_outline_part *first, const kmp_circle_place *place,
                       kmp_ref radius, kmp_ref *turn)
{
    kmp_graph *g = tree->graph;
    const run_rows rows = rows_of(g, first);
    kmp_ref x = place->at.x[0], y = place->at.x[1];
    (void)fold_place(tree, first, first->second, &x, &y);
    const kmp_ref index = index_of(tree, first, place, x, y);
    const kmp_ref nx = number_of(g, &rows, COLUMN_NORMAL_X, index), ny = number_of(g, &rows, COLUMN_NORMAL_Y, index);
    const kmp_ref ox = number_of(g, &rows, COLUMN_OUT_X, index), oy = number_of(g, &rows, COLUMN_OUT_Y, index);
    const kmp_ref round = number_of(g, &rows, COLUMN_ROUND, index);
    const kmp_ref reach = kmp_add(g, number_of(g, &rows, COLUMN_RADIUS, index), kmp_mul(g, round, radius));
    kmp_ref u[2];
    from_centre(g, &rows, index, x, y, u);
    const kmp_ref left = product_sum(g, ox, u[1], kmp_neg(oy), u[0]), out = product_sum(g, ox, u[0], oy, u[1]);
    const kmp_ref around = kmp_mul(g, reach, kmp_binary(g, KMP_OP_ATAN2, left, out));
    const kmp_ref begins = kmp_add(g, number_of(g, &rows, COLUMN_WAY, index),
                                   kmp_mul(g, radius, number_of(g, &rows, COLUMN_ANGLE, index)));
    if (rows.angle > KMP_TURN * (1 - KMP_WRITTEN_DIGITS)) /* all round a closed shape */
        *turn = kmp_add(g, kmp_const(g, rows.length / KMP_TURN), radius);
    return kmp_add(g, kmp_add(g, product_sum(g, nx, y, kmp_neg(ny), x), around), begins);
}

/* -- contacts ------------------------------------------------------------------------------------------ */

kmp_ref kmp_outline_gap(const kmp_tree *tree, const kmp_contact_pair *touch, const kmp_circle_place *place,
                        kmp_ref radius)
{
    kmp_graph *g = tree->graph;
    const kmp_outline_part *part = touch->side[1].piece;
    kmp_ref x = place->at.x[0], y = place->at.x[1];
    (void)fold_place(tree, part, part->second, &x, &y);
    if (part->next)
        return run_gap(tree, part, place, x, y, radius);
    const kmp_ref height = height_of(g, &part->piece, x, y);
    const kmp_ref between_ends = between(tree, part, place, x, y);
    const kmp_ref within = kmp_mul(g, between_ends, is_outside(tree, part, between_ends, height));
    if (part->depth < INFINITY)
        end_inside(tree, part, within, kmp_add(g, height, kmp_const(g, KMP_OUTLINE_INSIDE * part->depth)));
    for (int end = 0; end < 2; end++)
        if (part->reach[end] > 0)
            end_in_corner(tree, part, end, x, y, kmp_sub(g, height, radius));
    return kmp_select(g, within, kmp_sub(g, height, radius), kmp_const(g, part->away));
}

static void piece_normal(kmp_graph *g, const kmp_piece *piece, kmp_ref x, kmp_ref y, kmp_ref normal[2])
{
    for (int i = 0; i < 2; i++)
        normal[i] = kmp_const(g, piece->normal[i]);
    if (!piece->arc)
        return;
    const kmp_ref dx = kmp_sub(g, x, kmp_const(g, piece->centre[0])),
                  dy = kmp_sub(g, y, kmp_const(g, piece->centre[1]));
    const kmp_ref size = kmp_sqrt(g, product_sum(g, dx, dx, dy, dy));
    const kmp_ref over = kmp_div(g, kmp_const(g, piece->turn < 0 ? -1 : 1), size);
    normal[0] = kmp_mul(g, over, dx);
    normal[1] = kmp_mul(g, over, dy);
}

/* The gradient of the height in run_gap. */
static void run_normal(const kmp_tree *tree, const kmp_outline_part *first, const kmp_circle_place *place, kmp_ref x,
                       kmp_ref y, kmp_ref normal[2])
{
    kmp_graph *g = tree->graph;
    const run_rows rows = rows_of(g, first);
    const kmp_ref index = index_of(tree, first, place, x, y), nx = number_of(g, &rows, COLUMN_NORMAL_X, index);
    const kmp_ref ny = number_of(g, &rows, COLUMN_NORMAL_Y, index);
    kmp_ref u[2];
    from_centre(g, &rows, index, x, y, u);
    const kmp_ref size = kmp_sqrt(g, product_sum(g, u[0], u[0], u[1], u[1]));
    const kmp_ref over = kmp_div(g, number_of(g, &rows, COLUMN_ROUND, index), size);
    normal[0] = kmp_add(g, nx, kmp_mul(g, over, u[0]));
    normal[1] = kmp_add(g, ny, kmp_mul(g, over, u[1]));
}

/* The normal at the folded place, turned back to the copy where the place is. */
void kmp_outline_normal(const kmp_tree *tree, const kmp_contact_pair *touch, const kmp_circle_place *place,
                        kmp_ref normal[2])
{
    kmp_graph *g = tree->graph;
    const kmp_outline_part *part = touch->side[1].piece;
    kmp_ref x = place->at.x[0], y = place->at.x[1];
    (void)fold_place(tree, part, part->second, &x, &y);
    if (part->next)
        run_normal(tree, part, place, x, y, normal);
    else
        piece_normal(g, &part->piece, x, y, normal);
    if (!part->fold)
        return;
    const kmp_ref square = kmp_add(g, kmp_mul(g, x, x), kmp_mul(g, y, y));
    const complex_ref folded = {normal[0], normal[1]}, own = {place->at.x[0], place->at.x[1]}, back = {x, kmp_neg(y)};
    const complex_ref turned = times(g, folded, times(g, own, back));
    normal[0] = kmp_div(g, turned.re, square);
    normal[1] = kmp_div(g, turned.im, square);
}

/* Of a circle about (x, y): the length along a line, or the angle from the middle of an arc, which starts again on the
 * other side, and the distance from the arc's centre. */
static kmp_ref around(const kmp_tree *tree, const kmp_outline_part *part, const kmp_circle_place *place,
                      kmp_ref *distance)
{
    kmp_graph *g = tree->graph;
    const kmp_piece *piece = &part->piece;
    kmp_ref x = place->at.x[0], y = place->at.x[1];
    double middle[2], normal[2];
    (void)fold_place(tree, part, part->second, &x, &y);
    kmp_piece_tangent(piece, false, middle);
    if (!piece->arc)
        return along(g, middle, piece->from, x, y);
    kmp_piece_place(piece, 0.5, middle, normal);
    const double sign = piece->turn < 0 ? -1 : 1, out[2] = {sign * normal[0], sign * normal[1]};
    const double left[2] = {-out[1], out[0]};
    const kmp_ref sine = along(g, left, piece->centre, x, y), cosine = along(g, out, piece->centre, x, y);
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
