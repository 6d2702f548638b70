/* SPDX-License-Identifier: BSD-3-Clause */
/* A piece counts while the circle is between its borders, which are conditions: the distance jumps there to one at
 * which nothing touches, and the neighbour takes over with the same distance, normal and rates.
 *
 * Of n copies around the origin the nearest one is found without counting them. The circle has the angle p from the
 * middle of a copy. The sine and cosine of n p are a power of a complex number, and their angle within half a turn is n
 * times the angle from the middle of the nearest copy. The condition that the sine is negative joins its branches. */
#include "dynamics/kinematics/outline_contact.h"
#include "dynamics/kinematics/kinematics_conditions.h"
#include "dynamics/kinematics/kinematics_vectors.h"
#include "model/data/outline.h"
#include "symbolic/function_table.h"
#include <math.h>

#define TURN 6.28318530717958647692
/* Over the distance at which nothing touches: a border is passed by this, so that a body at rest on it stays on one
 * side. The neighbour's distance differs by the square of it. */
#define LAG 1e-12
/* Rounding of the sine of the angle between copies. */
#define FOLD_LAG 1e-12
/* Parts of the depth of the solid. A circle deeper than the first one is on the other side of it; a circle as deep as
 * the second one has passed through the surface. */
#define OTHER_SIDE 0.5
#define INSIDE     0.45

/* Conditions of a part. */
enum { PART_STANDS, PART_PASSES };

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

/* The place as it is at the first copy when the nearest one, or the second nearest, is turned there. *before: 1 where
 * the second nearest one is the copy before the nearest one, 0 where it is the copy behind it. */
static void fold_place(const kmp_tree *tree, const kmp_outline_part *part, bool second, kmp_ref *x, kmp_ref *y,
                       kmp_ref *before)
{
    kmp_graph *g = tree->graph;
    const kmp_outline_fold *fold = part->fold;
    const int n = fold->copies;
    const kmp_ref size = kmp_sqrt(g, kmp_add(g, kmp_mul(g, *x, *x), kmp_mul(g, *y, *y)));
    const complex_ref unit = {kmp_div(g, *x, size), kmp_div(g, *y, size)};
    const complex_ref back = {kmp_const(g, cos(n * fold->middle)), kmp_const(g, -sin(n * fold->middle))};
    const complex_ref turned = times(g, power_of(g, unit, n), back);
    const kmp_ref right = stands(tree, part, fold, turned.im, FOLD_LAG, "nearest copy");
    *before = right;
    const kmp_ref quarter = kmp_const(g, TURN / 4), one = kmp_const(g, 1.0 / n);
    const kmp_ref left_angle = kmp_add(g, quarter, kmp_binary(g, KMP_OP_ATAN2, kmp_neg(turned.re), turned.im));
    const kmp_ref right_angle = kmp_sub(g, kmp_binary(g, KMP_OP_ATAN2, turned.re, kmp_neg(turned.im)), quarter);
    kmp_ref angle = kmp_mul(g, one, kmp_select(g, right, right_angle, left_angle));
    if (second) {
        const kmp_ref step = kmp_const(g, TURN / n);
        angle = kmp_add(g, angle, kmp_select(g, right, step, kmp_neg(step)));
    }
    angle = kmp_add(g, angle, kmp_const(g, fold->middle));
    *x = kmp_mul(g, size, kmp_cos(g, angle));
    *y = kmp_mul(g, size, kmp_sin(g, angle));
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
    return stands(tree, part, border, kmp_neg(along(g, border->along, border->place, x, y)), LAG * part->away,
                  "beyond an end");
}

/* 1 behind the border where the piece begins, otherwise 0. `place`: not folded. */
static kmp_ref begins(const kmp_tree *tree, const kmp_outline_part *part, const kmp_vec *place, kmp_ref x, kmp_ref y)
{
    kmp_graph *g = tree->graph;
    const kmp_ref own = is_beyond(tree, part, part->low, x, y);
    kmp_ref before, other_x = place->x[0], other_y = place->x[1];
    if (!part->fold || !part->before)
        return own;
    fold_place(tree, part, !part->second, &other_x, &other_y, &before);
    const kmp_ref other = is_beyond(tree, part, part->before->high[0], other_x, other_y);
    return part->second ? kmp_select(g, before, own, other) : kmp_select(g, before, other, own);
}

/* 1 between the borders, otherwise 0. */
static kmp_ref between(const kmp_tree *tree, const kmp_outline_part *part, const kmp_vec *place, kmp_ref x, kmp_ref y)
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
    return within;
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

kmp_ref kmp_outline_gap(const kmp_tree *tree, const kmp_contact_pair *touch, const kmp_vec *place, kmp_ref radius)
{
    kmp_graph *g = tree->graph;
    const kmp_outline_part *part = touch->side[1].piece;
    kmp_ref x = place->x[0], y = place->x[1], before;
    if (part->fold)
        fold_place(tree, part, part->second, &x, &y, &before);
    const kmp_ref height = height_of(g, &part->piece, x, y);
    kmp_ref within = between(tree, part, place, x, y);
    if (part->depth < INFINITY) {
        const kmp_ref reach = kmp_add(g, height, kmp_const(g, OTHER_SIDE * part->depth));
        const kmp_ref deep = kmp_select(g, within, reach, KMP_ONE);
        within = kmp_mul(g, within, inverse(g, stands(tree, part, part, deep, 0, "on the other side of the solid")));
        const kmp_ref left = kmp_add(g, height, kmp_const(g, INSIDE * part->depth));
        kmp_tree_end(tree, part, PART_PASSES, kmp_select(g, within, left, KMP_ONE),
                     "it was not stopped at the surface: take smaller steps ('max_step'), or start outside",
                     "contact '%s' is inside the solid by half of its thickness", part->name);
    }
    return kmp_select(g, within, kmp_sub(g, height, radius), kmp_const(g, part->away));
}

/* Of a circle about (x, y): the length along a line, or the angle from the middle of an arc, which starts again on the
 * other side, and the distance from the arc's centre. */
static kmp_ref around(const kmp_tree *tree, const kmp_outline_part *part, const kmp_vec *place, kmp_ref *distance)
{
    kmp_graph *g = tree->graph;
    const kmp_piece *piece = &part->piece;
    kmp_ref x = place->x[0], y = place->x[1], before;
    double middle[2], normal[2];
    if (part->fold)
        fold_place(tree, part, part->second, &x, &y, &before);
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

kmp_ref kmp_outline_way(const kmp_tree *tree, const kmp_contact_pair *touch, const kmp_vec *place, kmp_ref radius,
                        kmp_ref rolled, kmp_ref *turn)
{
    kmp_graph *g = tree->graph;
    const kmp_piece *piece = &touch->side[1].piece->piece;
    kmp_ref unused, passed = around(tree, touch->side[1].piece, place, &unused);
    *turn = KMP_ZERO;
    if (!piece->arc)
        return kmp_sub(g, passed, rolled);
    const kmp_ref r = kmp_const(g, piece->radius);
    const kmp_ref reach = piece->turn < 0 ? kmp_sub(g, radius, r) : kmp_add(g, radius, r);
    if (fabs(piece->turn) >= TURN)
        *turn = reach;
    return kmp_sub(g, kmp_mul(g, reach, passed), rolled);
}

kmp_ref kmp_outline_slip(const kmp_tree *tree, const kmp_contact_pair *touch, const kmp_vec *place, kmp_ref rolled)
{
    kmp_graph *g = tree->graph;
    const kmp_piece *piece = &touch->side[1].piece->piece;
    kmp_ref distance, passed = around(tree, touch->side[1].piece, place, &distance);
    const kmp_vec rate = kmp_vec_rate(tree, (kmp_vec){{passed, rolled, KMP_ZERO}});
    const kmp_ref moved = piece->arc ? kmp_mul(g, distance, rate.x[0]) : rate.x[0];
    return kmp_sub(g, piece->arc && piece->turn < 0 ? kmp_neg(moved) : moved, rate.x[1]);
}
