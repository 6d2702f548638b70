/* SPDX-License-Identifier: BSD-3-Clause */
/* Outlines: finite plane shapes of contacts, as lists of straight pieces and arcs in the x-y plane of the point that
 * carries them. */
#pragma once

#include "base/arena.h"
#include "model/data/place.h"
#include <stdbool.h>

struct kmp_cam;

/* The rows of outline_shapes.def. */
typedef enum kmp_outline_shape {
#define KMP_OUTLINE(kind, ...) KMP_OUTLINE_##kind,
#include "model/data/outline_shapes.def"
#undef KMP_OUTLINE
    KMP_OUTLINE_SHAPES
} kmp_outline_shape;

/** The words of the shapes, and of each the further keys that it may have. */
extern const char *const kmp_outline_words[KMP_OUTLINE_SHAPES], *const kmp_outline_more[KMP_OUTLINE_SHAPES];

/** The corner of the outline at the end of a piece. */
typedef enum kmp_outline_joint {
    KMP_OUTLINE_ENDS,   /* not at all: half a turn about the end of an open outline */
    KMP_OUTLINE_SMOOTH, /* with the same tangent */
    KMP_OUTLINE_CONVEX, /* with a corner out of the solid */
    KMP_OUTLINE_CONCAVE /* with a corner into the solid */
} kmp_outline_joint;

/** A straight piece, or an arc with its centre. The solid is on the left from its beginning to its end. */
typedef struct kmp_piece {
    bool arc;
    double from[2], to[2];
    double centre[2], radius; /* of an arc; 0: a sharp corner */
    double turn;              /* of an arc: its angle, negative where it goes clockwise: it is hollow there */
    double normal[2];         /* out of the solid, where the piece begins */
    kmp_outline_joint joint;  /* at its end */
    int corner;               /* the edge, from 1, behind which this is a corner; 0: it is none */
    int run;                  /* its convex run, from 0 */
} kmp_piece;

/** Pieces follow each other; a closed outline returns from the last one to the first, of the next copy. */
typedef struct kmp_outline {
    const char *name;
    kmp_place place;
    kmp_outline_shape shape;
    bool closed, hollow; /* hollow: as the key says */
    int copies;
    double round;
    int piece_count, run_count;
    kmp_piece *pieces; /* of one copy; the pieces of a run follow each other on the border of one convex shape: a circle
                          touches one of them at a time */
    struct kmp_cam *cam; /* (cam.h); NULL: it consists of pieces */
} kmp_outline;

/** An edge of a shape: from the end of the one before to `to`, straight or an arc about `centre` by the angle `turn`.
 */
typedef struct kmp_outline_edge {
    double from[2], to[2], centre[2], turn;
    bool arc;
} kmp_outline_edge;

/** Copies of an outline around its origin: contacts see the two nearest ones. Its address identifies the condition
 * for the side of the nearest copy on which they are. */
typedef struct kmp_outline_fold {
    int copies;
    double middle; /* the angle of the middle of the first copy */
} kmp_outline_fold;

/** A line across which a contact leaves a piece, where (x - place) . along becomes positive. Its address is the
 * condition that it has left: neighbours share it. */
typedef struct kmp_outline_border {
    double place[2], along[2];
} kmp_outline_border;

/** A piece as the surface of a contact. It counts between its borders: behind `low` and before all of `high`. */
typedef struct kmp_outline_part {
    const char *name; /* of the contact */
    kmp_piece piece;
    const kmp_outline_fold *fold;            /* NULL: no copies */
    bool second;                             /* of the second nearest copy */
    const kmp_outline_border *low, *high[3]; /* NULL: none */
    /** Of the first piece of copies: the last one of the other nearest copy, with whose border it begins where that
     * copy is before its own; NULL: its own border. */
    const struct kmp_outline_part *before;
    struct kmp_outline_part *next; /* the further pieces of the same contact, of one run; NULL: none */
    /** Of a piece for points: the sharp corners beyond its ends, by number from 1; negative: between two copies. 0:
     * none. */
    int tip[2];
    /** With a law, of ends at a hollow corner: how far beyond the corner the piece counts in the solid. 0: none. */
    double reach[2];
    /** Of a line with such a corner, for a sharp corner of the other outline, whose edges away from it are in the axes
     * of its point: the line counts where both are on its free side. */
    bool meets_corner;
    double edge[2][2];
    bool either;  /* of an arc of more than half a turn: one of both borders suffices */
    double depth; /* how far the solid reaches behind the piece; INFINITY: farther than it counts */
    double away;  /* the distance that the contact has where the piece does not count */
} kmp_outline_part;

/** The pieces of edges that follow each other counter-clockwise about the solid: edges, and arcs at convex corners. A
 * corner between straight edges that is shorter than its rounding needs is `*wrong`, from 0. */
bool kmp_outline_make(kmp_arena *arena, const kmp_outline_edge *edges, int count, kmp_outline *outline, int *wrong);

/** True for a convex corner without a radius. */
bool kmp_piece_is_sharp(const kmp_piece *piece);

/** A piece turned about the origin to copy k. */
kmp_piece kmp_piece_copy(const kmp_outline *outline, int piece, int copy);

/** The unit tangent of a piece where it begins, or where it ends. */
void kmp_piece_tangent(const kmp_piece *piece, bool at_end, double along[2]);

/** A place of a piece, from 0 where it begins to 1 where it ends, and the normal out of the solid there. */
void kmp_piece_place(const kmp_piece *piece, double part, double place[2], double normal[2]);

/** The height of a place over the line or the circle of a piece, positive out of the solid; its distance from the piece
 * with its ends. */
double kmp_piece_height(const kmp_piece *piece, const double place[2]);
double kmp_piece_distance(const kmp_piece *piece, const double place[2]);

/** The pieces that a circle of some radius meets: no sharp corners without one. */
bool kmp_piece_meets(const kmp_piece *piece, bool round);

/** The length of the largest side of a box about the outline. */
double kmp_outline_size(const kmp_outline *outline);

/** True if a straight piece crosses another piece, of a path also of a copy: *place. Arcs that
 * cross arcs are not found. */
bool kmp_outline_crosses(const kmp_outline *outline, double place[2]);

/** The parts of an outline for a circle of this radius, 2 for each piece of copies, otherwise 1: `parts` has room for
 * them. False: no memory. */
bool kmp_outline_parts(kmp_arena *arena, const kmp_outline *outline, double radius, kmp_outline_part *parts);
