/* SPDX-License-Identifier: BSD-3-Clause */
/* The pieces of an outline as surfaces of contacts. A piece counts between the lines across its ends, which neighbours
 * with one tangent share, and as far behind it as its solid reaches: beyond half of that a circle is on the other side
 * of the solid. The line that halves a corner is a further border where the other side of the corner is near the line
 * across the end. */
#include "constraints/tolerances.h"
#include "model/data/outline.h"
#include <math.h>
#include <string.h>

#define TURN 6.28318530717958647692
/* Directions that look for the far side of the solid, for each piece. */
enum { RAYS = 33 };

/* -- borders ------------------------------------------------------------------------------------------- */

static kmp_outline_border *border_at(kmp_arena *arena, const double place[2], const double along[2], double shift)
{
    kmp_outline_border *border = KMP_ARENA_NEW(arena, kmp_outline_border, 1);
    for (int i = 0; border && i < 2; i++) {
        border->place[i] = place[i] + shift * along[i];
        border->along[i] = along[i];
    }
    return border;
}

static double length_of(const kmp_piece *piece)
{
    return piece->arc ? piece->radius * fabs(piece->turn)
                      : hypot(piece->to[0] - piece->from[0], piece->to[1] - piece->from[1]);
}

/* The line that halves a corner, at the end or the beginning of a piece; NULL: the corner is none. It begins at the
 * centre of a round corner, because up to there the arc takes over from the piece at the line across its end. */
static const kmp_outline_border *halving(kmp_arena *arena, const kmp_piece *piece, const kmp_piece *corner,
                                         const kmp_piece *other, bool at_end, double shift)
{
    double own[2], next[2], along[2];
    kmp_piece_tangent(piece, at_end, own);
    kmp_piece_tangent(other, !at_end, next);
    const double turn = own[0] * next[0] + own[1] * next[1];
    if (turn > KMP_OUTLINE_OBTUSE)
        return NULL;
    const double size = hypot(own[0] + next[0], own[1] + next[1]), side = at_end ? 1 : -1;
    for (int i = 0; i < 2; i++)
        along[i] = size > 0 ? side * (own[i] + next[i]) / size : 0;
    return border_at(arena, corner->centre, along, shift);
}

/* -- the solid behind a piece -------------------------------------------------------------------------- */

/* The way of a ray from a place along a unit vector to a piece; INFINITY: it does not meet it. */
static double ray_to(const double place[2], const double along[2], const kmp_piece *piece, double least)
{
    double t[2];
    const double x = place[0] - (piece->arc ? piece->centre[0] : piece->from[0]);
    const double y = place[1] - (piece->arc ? piece->centre[1] : piece->from[1]);
    if (!piece->arc) {
        kmp_piece_tangent(piece, false, t);
        const double across = along[0] * t[1] - along[1] * t[0];
        if (fabs(across) < KMP_OUTLINE_STRAIGHT)
            return INFINITY;
        const double far = -(x * t[1] - y * t[0]) / across;
        const double s = (x + far * along[0]) * t[0] + (y + far * along[1]) * t[1];
        return far > least && s >= 0 && s <= length_of(piece) ? far : INFINITY;
    }
    const double b = x * along[0] + y * along[1], c = x * x + y * y - piece->radius * piece->radius;
    const double root = b * b - c;
    for (int k = 0; root > 0 && k < 2; k++) {
        const double far = -b + (k ? sqrt(root) : -sqrt(root));
        const double px = x + far * along[0], py = y + far * along[1];
        double from = atan2(piece->normal[1], piece->normal[0]) + (piece->turn < 0 ? TURN / 2 : 0);
        double angle = fmod(atan2(py, px) - from, TURN);
        angle = piece->turn > 0 ? fmod(angle + TURN, TURN) : fmod(angle - TURN, TURN);
        if (far > least && fabs(angle) <= fabs(piece->turn))
            return far;
    }
    return INFINITY;
}

bool kmp_outline_crosses(const kmp_outline *outline, double place[2])
{
    const double slack = KMP_WRITTEN_DIGITS * kmp_outline_size(outline);
    const int copies = outline->shape == KMP_OUTLINE_PATH ? outline->copies : 1;
    for (int k = 0; k < outline->piece_count; k++)
        for (int copy = 0; copy < copies; copy++)
            for (int i = 0; i < outline->piece_count; i++) {
                const kmp_piece *piece = &outline->pieces[k], other = kmp_piece_copy(outline, i, copy);
                double along[2];
                if (piece->arc || (i == k && copy == 0))
                    continue;
                kmp_piece_tangent(piece, false, along);
                const double far = ray_to(piece->from, along, &other, slack);
                if (far >= length_of(piece) - slack)
                    continue;
                for (int j = 0; j < 2; j++)
                    place[j] = piece->from[j] + far * along[j];
                /* a corner that only touches does not cross */
                if (hypot(place[0] - other.from[0], place[1] - other.from[1]) < slack ||
                    hypot(place[0] - other.to[0], place[1] - other.to[1]) < slack)
                    continue;
                return true;
            }
    return false;
}

static bool is_beyond(const kmp_outline_border *border, const double place[2])
{
    return border &&
           (place[0] - border->place[0]) * border->along[0] + (place[1] - border->place[1]) * border->along[1] > 0;
}

/* The least way through the solid behind a piece, between its borders, and beyond its ends by their reach. */
static double depth_of(const kmp_outline *outline, const kmp_outline_part *part, double size)
{
    const double *reach = part->reach;
    double depth = INFINITY;
    for (int k = -1; k <= RAYS; k++) {
        double place[2], normal[2], along[2], far = INFINITY;
        const bool at_end = k == RAYS;
        if ((k < 0 || at_end) && reach[at_end] == 0)
            continue;
        kmp_piece_place(&part->piece, fmin(fmax((k + 0.5) / RAYS, 0), 1), place, normal);
        kmp_piece_tangent(&part->piece, at_end, along);
        for (int i = 0; (k < 0 || at_end) && i < 2; i++)
            place[i] += (at_end ? reach[1] : -reach[0]) * along[i];
        const double inward[2] = {-normal[0], -normal[1]};
        for (int copy = 0; copy < outline->copies; copy++)
            for (int i = 0; i < outline->piece_count; i++) {
                const kmp_piece other = kmp_piece_copy(outline, i, copy);
                far = fmin(far, ray_to(place, inward, &other, KMP_WRITTEN_DIGITS * size));
            }
        const double exit[2] = {place[0] + far * inward[0], place[1] + far * inward[1]};
        if (far < INFINITY && !is_beyond(part->high[1], exit) && !is_beyond(part->high[2], exit))
            depth = fmin(depth, far);
    }
    return depth;
}

/* -- parts --------------------------------------------------------------------------------------------- */

/* The angle of the middle of a copy about the origin. */
static double middle_of(const kmp_outline *outline)
{
    double x = 0, y = 0, place[2], normal[2];
    for (int k = 0; k < outline->piece_count; k++)
        for (int j = 0; j <= 8; j++) {
            kmp_piece_place(&outline->pieces[k], j / 8.0, place, normal);
            const double size = hypot(place[0], place[1]);
            x += size > 0 ? place[0] / size : 0;
            y += size > 0 ? place[1] / size : 0;
        }
    return atan2(y, x);
}

/* The neighbour of piece k, before it or behind it; turned, where it belongs to another copy. NULL: none. */
static const kmp_piece *neighbour(const kmp_outline *outline, int k, bool behind, kmp_piece *made)
{
    const int n = outline->piece_count, next = behind ? (k + 1) % n : (k + n - 1) % n;
    const bool around = behind ? k == n - 1 : k == 0;
    if (around && !outline->closed)
        return NULL;
    const bool joins = around && outline->shape == KMP_OUTLINE_PATH && outline->copies > 1;
    *made = kmp_piece_copy(outline, next, joins ? (behind ? 1 : outline->copies - 1) : 0);
    return made;
}

/* The corner of a sharp tip at one end of a piece that a point meets: its number, negative where the corner belongs to
 * another copy; 0: none. */
static int tip_of(const kmp_outline *outline, int k, bool behind, double radius)
{
    kmp_piece made;
    const kmp_piece *other = neighbour(outline, k, behind, &made);
    const bool around = behind ? k == outline->piece_count - 1 : k == 0;
    const bool apart = around && outline->shape == KMP_OUTLINE_PATH && outline->copies > 1;
    const bool tip = radius == 0 && outline->pieces[k].corner == 0 && other && kmp_piece_is_sharp(other);
    return !tip ? 0 : apart ? -other->corner : other->corner;
}

/* A piece counts beyond a hollow corner into the solid, because a circle that presses on both sides by a law is behind
 * each of them. Up to half of the way to the next piece there is nothing but solid. Returns that length; 0 at other
 * ends. */
static double reach_of(const kmp_outline *outline, int k, bool behind)
{
    kmp_piece made;
    const kmp_piece *piece = &outline->pieces[k], *other = neighbour(outline, k, behind, &made);
    const double *corner = behind ? piece->to : piece->from;
    const int n = outline->piece_count, copies = outline->shape == KMP_OUTLINE_PATH ? outline->copies : 1;
    double least = 2 * kmp_outline_size(outline);
    if ((behind ? piece->joint : other ? other->joint : KMP_OUTLINE_ENDS) != KMP_OUTLINE_CONCAVE)
        return 0;
    for (int copy = 0; copy < copies; copy++)
        for (int i = 0; i < n; i++) {
            const kmp_piece next = kmp_piece_copy(outline, i, copy);
            const double way = kmp_piece_distance(&next, corner);
            if (way > KMP_WRITTEN_DIGITS * kmp_outline_size(outline)) /* not a side of this corner */
                least = fmin(least, way);
        }
    return 0.5 * least;
}

/* One side of piece k. */
static void bound_side(kmp_arena *arena, const kmp_outline *outline, int k, bool behind, double radius, double reach,
                       kmp_outline_part *part, const kmp_outline_border **shared)
{
    const kmp_piece *piece = &part->piece;
    kmp_piece made;
    const kmp_piece *other = neighbour(outline, k, behind, &made);
    const kmp_outline_joint joint = behind ? piece->joint : other ? other->joint : KMP_OUTLINE_ENDS;
    const bool around = behind ? k == outline->piece_count - 1 : k == 0;
    const bool apart = around && outline->shape == KMP_OUTLINE_PATH && outline->copies > 1;
    const bool tip = part->tip[behind] != 0;
    double along[2];
    kmp_piece_tangent(piece, behind, along);
    const double shift = tip ? KMP_OUTLINE_CORNER * kmp_outline_size(outline) : reach;
    const kmp_outline_border *border =
        *shared && !tip /* the neighbour has made it */
            ? *shared
            : border_at(arena, behind ? piece->to : piece->from, along, behind ? shift : -shift);
    if (behind)
        part->high[0] = border;
    else
        part->low = border;
    if (joint != KMP_OUTLINE_CONCAVE && !apart && !tip && other && (radius > 0 || joint == KMP_OUTLINE_SMOOTH))
        *shared = border;
}

/* Halves of corners: the neighbour behind a sharp or a rounded corner is the straight piece or arc after it. */
static const kmp_outline_border *halve(kmp_arena *arena, const kmp_outline *outline, int k, bool behind, bool tip)
{
    kmp_piece made, beyond;
    const int n = outline->piece_count;
    const kmp_piece *corner = neighbour(outline, k, behind, &made);
    if (!corner || corner->corner == 0 || n < 3)
        return NULL;
    const int at = behind ? (k + 1) % n : (k + n - 1) % n;
    const kmp_piece *other = neighbour(outline, at, behind, &beyond);
    const double shift = tip ? KMP_OUTLINE_CORNER * kmp_outline_size(outline) : 0;
    return other ? halving(arena, &outline->pieces[k], corner, other, behind, shift) : NULL;
}

static bool make_class(kmp_arena *arena, const kmp_outline *outline, double radius, const kmp_outline_fold *fold,
                       bool second, kmp_outline_part *parts)
{
    const int n = outline->piece_count;
    const double size = kmp_outline_size(outline);
    const kmp_outline_border *first = NULL, *last = NULL;
    const bool whole = n == 1 && outline->pieces[0].arc && fabs(outline->pieces[0].turn) >= TURN;
    for (int k = 0; k < n; k++) {
        kmp_outline_part *part = &parts[k];
        *part = (kmp_outline_part){
            .piece = outline->pieces[k], .fold = fold, .second = second, .away = 2 * size + 4 * radius};
        part->depth = INFINITY;
        part->either = part->piece.arc && fabs(part->piece.turn) > TURN / 2;
        if (whole)
            continue;
        for (int end = 0; end < 2; end++) {
            part->tip[end] = tip_of(outline, k, end, radius);
            part->reach[end] = reach_of(outline, k, end);
        }
        const kmp_outline_border *low = k == 0 ? NULL : last, *high = k == n - 1 ? first : NULL;
        bound_side(arena, outline, k, false, radius, part->reach[0], part, &low);
        bound_side(arena, outline, k, true, radius, part->reach[1], part, &high);
        first = k == 0 ? low : first;
        last = high;
        if (part->piece.corner == 0) {
            part->high[1] = halve(arena, outline, k, true, part->tip[1] != 0);
            part->high[2] = halve(arena, outline, k, false, part->tip[0] != 0);
            part->depth = depth_of(outline, part, size);
        }
    }
    return !arena->failed;
}

bool kmp_outline_parts(kmp_arena *arena, const kmp_outline *outline, double radius, kmp_outline_part *parts)
{
    kmp_outline_fold *fold = NULL;
    if (outline->copies > 1) {
        fold = KMP_ARENA_NEW(arena, kmp_outline_fold, 1);
        if (!fold)
            return false;
        *fold = (kmp_outline_fold){outline->copies, middle_of(outline)};
    }
    if (!make_class(arena, outline, radius, fold, false, parts))
        return false;
    kmp_outline_part *others = parts + outline->piece_count;
    if (!fold || !make_class(arena, outline, radius, fold, true, others))
        return !fold;
    const int last = outline->piece_count - 1;
    if (outline->closed && outline->shape == KMP_OUTLINE_PATH && parts[last].piece.joint != KMP_OUTLINE_CONCAVE) {
        parts[0].before = &others[last];
        others[0].before = &parts[last];
    }
    return true;
}
