/* SPDX-License-Identifier: BSD-3-Clause */
#include "model/data/outline.h"
#include "constraints/tolerances.h"
#include "model/language/dimension.h"
#include <math.h>
#include <stddef.h>

const char *const kmp_outline_words[KMP_OUTLINE_SHAPES] = {
#define KMP_OUTLINE(kind, word, ...) #word,
#include "model/data/outline_shapes.def"
#undef KMP_OUTLINE
};
const char *const kmp_outline_more[KMP_OUTLINE_SHAPES] = {
#define KMP_OUTLINE(kind, word, reader, keys) keys,
#include "model/data/outline_shapes.def"
#undef KMP_OUTLINE
};

static void turned(const double a[2], double angle, double b[2])
{
    const double x = a[0], y = a[1], c = cos(angle), s = sin(angle);
    b[0] = c * x - s * y;
    b[1] = s * x + c * y;
}

/* The direction of an edge where it begins, or where it ends. */
static void tangent_of(const kmp_outline_edge *edge, bool at_end, double t[2])
{
    const double *place = at_end ? edge->to : edge->from;
    double x = edge->to[0] - edge->from[0], y = edge->to[1] - edge->from[1];
    if (edge->arc) {
        const double side = edge->turn > 0 ? 1 : -1;
        x = -side * (place[1] - edge->centre[1]);
        y = side * (place[0] - edge->centre[0]);
    }
    const double size = hypot(x, y);
    t[0] = x / size;
    t[1] = y / size;
}

/* -- corners ------------------------------------------------------------------------------------------- */

/* The corner at the end of an edge. */
typedef struct corner {
    double in[2], out[2]; /* directions before and behind it */
    double turn;          /* to the left */
    double cut;           /* what its rounding takes of both edges */
    kmp_outline_joint joint;
} corner;

static corner corner_of(const kmp_outline_edge *edge, const kmp_outline_edge *next, double round)
{
    corner c = {.joint = KMP_OUTLINE_ENDS};
    tangent_of(edge, true, c.in);
    if (!next) {
        c.joint = KMP_OUTLINE_CONVEX;
        c.turn = KMP_TURN / 2;
        return c;
    }
    tangent_of(next, false, c.out);
    const double across = c.in[0] * c.out[1] - c.in[1] * c.out[0], along = c.in[0] * c.out[0] + c.in[1] * c.out[1];
    c.turn = atan2(across, along);
    c.joint = fabs(across) < KMP_OUTLINE_TANGENT && along > 0 ? KMP_OUTLINE_SMOOTH
              : c.turn > 0                                    ? KMP_OUTLINE_CONVEX
                                                              : KMP_OUTLINE_CONCAVE;
    if (c.joint == KMP_OUTLINE_CONVEX && !edge->arc && !next->arc)
        c.cut = round * tan(c.turn / 2);
    return c;
}

/* Out of a solid on the left of a direction. */
static void right_of(const double t[2], double n[2])
{
    n[0] = t[1];
    n[1] = -t[0];
}

static kmp_piece piece_of(const kmp_outline_edge *edge, double cut_before, double cut_behind)
{
    kmp_piece piece = {.arc = edge->arc, .turn = edge->turn};
    double t[2];
    tangent_of(edge, false, t);
    right_of(t, piece.normal);
    for (int i = 0; i < 2; i++) {
        piece.centre[i] = edge->centre[i];
        piece.from[i] = edge->from[i] + cut_before * t[i];
        piece.to[i] = edge->to[i] - cut_behind * t[i];
    }
    if (edge->arc)
        piece.radius = hypot(edge->from[0] - edge->centre[0], edge->from[1] - edge->centre[1]);
    return piece;
}

/* The arc in place of a convex corner at a place; half a turn at either end of an open outline. */
static kmp_piece corner_piece(const corner *c, const double place[2], double radius)
{
    kmp_piece piece = {.arc = true, .radius = radius, .turn = c->turn, .joint = KMP_OUTLINE_SMOOTH};
    right_of(c->in, piece.normal);
    for (int i = 0; i < 2; i++) {
        piece.from[i] = place[i] - c->cut * c->in[i];
        piece.centre[i] = piece.from[i] - radius * piece.normal[i];
    }
    turned(piece.normal, piece.turn, piece.to);
    for (int i = 0; i < 2; i++)
        piece.to[i] = piece.centre[i] + radius * piece.to[i];
    return piece;
}

/* -- pieces -------------------------------------------------------------------------------------------- */

static bool make_pieces(kmp_arena *arena, const kmp_outline_edge *edges, int count, kmp_outline *outline, int *wrong)
{
    const double step = KMP_TURN / outline->copies;
    const bool whole = count == 1 && edges[0].arc && fabs(edges[0].turn) >= KMP_TURN;
    double before = 0;
    outline->pieces = KMP_ARENA_NEW(arena, kmp_piece, 2 * count + 1);
    if (!outline->pieces)
        return false;
    if (whole) {
        outline->pieces[outline->piece_count++] = piece_of(&edges[0], 0, 0);
        return true;
    }
    kmp_outline_edge next = edges[0];
    if (outline->closed && outline->shape == KMP_OUTLINE_PATH && outline->copies > 1) {
        turned(edges[0].from, step, next.from);
        turned(edges[0].to, step, next.to);
        turned(edges[0].centre, step, next.centre);
    }
    if (outline->closed) {
        before = corner_of(&edges[count - 1], &next, outline->round).cut;
    } else {
        corner begin = {.turn = KMP_TURN / 2};
        tangent_of(&edges[0], false, begin.in);
        begin.in[0] = -begin.in[0];
        begin.in[1] = -begin.in[1];
        outline->pieces[outline->piece_count] = corner_piece(&begin, edges[0].from, 0);
        outline->pieces[outline->piece_count++].corner = count + 1;
    }
    for (int k = 0; k < count; k++) {
        const kmp_outline_edge *behind = k + 1 < count ? &edges[k + 1] : outline->closed ? &next : NULL;
        const corner c = corner_of(&edges[k], behind, outline->round);
        const double length = hypot(edges[k].to[0] - edges[k].from[0], edges[k].to[1] - edges[k].from[1]);
        if (!edges[k].arc && !(before + c.cut < length)) {
            *wrong = k;
            return false;
        }
        kmp_piece *piece = &outline->pieces[outline->piece_count++];
        *piece = piece_of(&edges[k], before, c.cut);
        piece->joint = c.joint;
        if (c.joint == KMP_OUTLINE_CONVEX) {
            const bool rounded = c.cut > 0;
            if (rounded)
                piece->joint = KMP_OUTLINE_SMOOTH;
            kmp_piece *arc = &outline->pieces[outline->piece_count++];
            *arc = corner_piece(&c, edges[k].to, rounded ? outline->round : 0);
            arc->corner = k + 1;
        }
        before = c.cut;
    }
    return true;
}

/* True if a piece is nowhere outside the tangents at both ends of another one. */
static bool is_behind(const kmp_piece *piece, const kmp_piece *other, double slack)
{
    for (int j = 0; j <= 4; j++)
        for (int end = 0; end < 2; end++) {
            double place[2], normal[2], along[2];
            const double *from = end ? other->to : other->from;
            kmp_piece_place(piece, j / 4.0, place, normal);
            kmp_piece_tangent(other, end, along);
            right_of(along, normal);
            if ((place[0] - from[0]) * normal[0] + (place[1] - from[1]) * normal[1] > slack)
                return false;
        }
    return true;
}

static bool is_convex(const kmp_piece *piece)
{
    return !piece->arc || (piece->turn >= 0 && piece->turn <= KMP_TURN / 2);
}

bool kmp_outline_make(kmp_arena *arena, const kmp_outline_edge *edges, int count, kmp_outline *outline, int *wrong)
{
    if (!make_pieces(arena, edges, count, outline, wrong))
        return false;
    /* runs are as long as all their pieces are on the border of one convex shape */
    const double slack = KMP_OUTLINE_TANGENT * kmp_outline_size(outline);
    for (int k = 0, first = 0; k < outline->piece_count; k++) {
        kmp_piece *piece = &outline->pieces[k];
        bool joins = k > 0 && is_convex(piece) && is_convex(&piece[-1]) && piece[-1].joint != KMP_OUTLINE_CONCAVE;
        for (int i = first; joins && i < k; i++)
            joins = is_behind(piece, &outline->pieces[i], slack) && is_behind(&outline->pieces[i], piece, slack);
        if (!joins) {
            first = k;
            outline->run_count++;
        }
        piece->run = outline->run_count - 1;
    }
    return true;
}

void kmp_piece_tangent(const kmp_piece *piece, bool at_end, double along[2])
{
    double n[2];
    turned(piece->normal, at_end && piece->arc ? piece->turn : 0, n);
    along[0] = -n[1];
    along[1] = n[0];
}

void kmp_piece_place(const kmp_piece *piece, double part, double place[2], double normal[2])
{
    turned(piece->normal, piece->arc ? part * piece->turn : 0, normal);
    const double out = piece->turn < 0 ? -piece->radius : piece->radius;
    for (int i = 0; i < 2; i++)
        place[i] =
            piece->arc ? piece->centre[i] + out * normal[i] : piece->from[i] + part * (piece->to[i] - piece->from[i]);
}

kmp_piece kmp_piece_copy(const kmp_outline *outline, int piece, int copy)
{
    kmp_piece made = outline->pieces[piece];
    const double angle = KMP_TURN * copy / outline->copies;
    const kmp_piece *one = &outline->pieces[piece];
    turned(one->from, angle, made.from);
    turned(one->to, angle, made.to);
    turned(one->centre, angle, made.centre);
    turned(one->normal, angle, made.normal);
    return made;
}

double kmp_piece_height(const kmp_piece *piece, const double place[2])
{
    if (!piece->arc)
        return (place[0] - piece->from[0]) * piece->normal[0] + (place[1] - piece->from[1]) * piece->normal[1];
    const double size = hypot(place[0] - piece->centre[0], place[1] - piece->centre[1]);
    return piece->turn < 0 ? piece->radius - size : size - piece->radius;
}

double kmp_piece_distance(const kmp_piece *piece, const double place[2])
{
    double before[2], behind[2], along[2];
    kmp_piece_tangent(piece, false, before);
    kmp_piece_tangent(piece, true, along);
    const double first = (place[0] - piece->from[0]) * before[0] + (place[1] - piece->from[1]) * before[1];
    const double last = (place[0] - piece->to[0]) * along[0] + (place[1] - piece->to[1]) * along[1];
    const bool more = piece->arc && fabs(piece->turn) > KMP_TURN / 2;
    behind[0] = hypot(place[0] - piece->from[0], place[1] - piece->from[1]);
    behind[1] = hypot(place[0] - piece->to[0], place[1] - piece->to[1]);
    const bool within = more ? first >= 0 || last <= 0 : first >= 0 && last <= 0;
    return within ? fabs(kmp_piece_height(piece, place)) : fmin(behind[0], behind[1]);
}

bool kmp_piece_is_sharp(const kmp_piece *piece)
{
    return piece->corner > 0 && piece->radius == 0;
}

bool kmp_piece_meets(const kmp_piece *piece, bool round)
{
    return round || !piece->arc || piece->radius > 0;
}

double kmp_outline_size(const kmp_outline *outline)
{
    double low[2] = {INFINITY, INFINITY}, high[2] = {-INFINITY, -INFINITY}, place[2], normal[2];
    for (int copy = 0; copy < outline->copies; copy++)
        for (int k = 0; k < outline->piece_count; k++) {
            const kmp_piece piece = kmp_piece_copy(outline, k, copy);
            for (int j = 0; j <= 8; j++) {
                kmp_piece_place(&piece, j / 8.0, place, normal);
                for (int i = 0; i < 2; i++) {
                    low[i] = fmin(low[i], place[i]);
                    high[i] = fmax(high[i], place[i]);
                }
            }
        }
    return fmax(high[0] - low[0], high[1] - low[1]);
}
