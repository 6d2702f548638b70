/* SPDX-License-Identifier: BSD-3-Clause */
/* Common definitions of point_gap.c (the choice), point_gap_points.c (variants of a point) and point_gap_rows.c (rows
 * by them). */
#pragma once

#include "dynamics/shorten/point_gap.h"
#include "symbolic/derivative.h"

typedef enum kmp_gap_variant { KMP_GAP_DERIVED, KMP_GAP_INWARD, KMP_GAP_OUTWARD, KMP_GAP_VARIANTS } kmp_gap_variant;

/* Parts of a row that are exchanged together. */
typedef enum kmp_gap_part { KMP_GAP_PLACE, KMP_GAP_RATE, KMP_GAP_PARTS } kmp_gap_part; /* h and J; hdot and jdqd */

/* A link relative to an ancestor, in the ancestor's axes. */
typedef struct kmp_gap_seen {
    bool known;
    kmp_vec axes[3], origin, v, a, w, wd;
    kmp_matrix beta;
} kmp_gap_seen;

/* The motion of a point from an ancestor. */
typedef struct kmp_gap_motion {
    kmp_vec x, v, a;
} kmp_gap_motion;

/* One of the two points. */
typedef struct kmp_gap_side {
    int ancestor, link; /* the common ancestor of both points; the point's link */
    kmp_vec local;      /* from the link's origin */
    kmp_gap_motion by[KMP_GAP_VARIANTS];
    kmp_vec *column; /* n: dx/dq, derived */
} kmp_gap_side;

/* The rows of a closure with either side by one of the variants. */
typedef struct kmp_gap_version {
    bool known[KMP_GAP_PARTS];
    kmp_ref *place; /* h, then J by rows */
    kmp_ref *rate;  /* hdot, then jdqd */
} kmp_gap_version;

typedef struct kmp_gap {
    int closure, row, count; /* the rows of the closure */
    kmp_gap_side side[2];
    bool moves[3]; /* components of d that depend on coordinates */
    kmp_vec d;
    kmp_gap_variant chosen[KMP_GAP_PARTS][2];
    kmp_gap_version version[KMP_GAP_VARIANTS][KMP_GAP_VARIANTS];
} kmp_gap;

typedef struct kmp_gaps {
    kmp_equations *eq;
    unsigned sets;
    kmp_gap *list;
    int count;
    int view; /* ancestor that `seen` belongs to */
    kmp_gap_seen *seen;
    kmp_vec *arm; /* from each link's origin to the current point, link axes */
    int *path;
    kmp_derivative *derivative; /* along one direction after the other */
} kmp_gaps;

/* point_gap_points.c */

kmp_gap_motion kmp_gap_move_inward(kmp_gaps *s, const kmp_gap_side *p);
kmp_gap_motion kmp_gap_move_outward(kmp_gaps *s, const kmp_gap_side *p);

/** One row of J for one of the points, with f the row's gradient by its position. Entries are velocities of the point
 * by each joint's motion, along f in the ancestor's axes. */
void kmp_gap_row_inward(kmp_gaps *s, const kmp_gap_side *p, kmp_vec f, kmp_ref *row);
void kmp_gap_row_outward(kmp_gaps *s, const kmp_gap_side *p, kmp_vec f, kmp_ref *row);
void kmp_gap_row_derived(kmp_gaps *s, const kmp_gap_side *p, kmp_vec f, kmp_ref *row);

/** Differentiation along a direction, valid until the next call; owned by s. NULL: no memory. */
kmp_derivative *kmp_gap_along(kmp_gaps *s, int count, const kmp_ref *leaf, const kmp_ref *direction);

/** dx/dq of all sides, and their rates, by differentiation. */
void kmp_gap_derive_sides(kmp_gaps *s);

/* point_gap_rows.c */

/** The number of references of a closure's KMP_GAP_PLACE part: h, and J by rows. */
int kmp_gap_place_count(const kmp_gaps *s, const kmp_gap *p);

/** True if rows h depend on coordinates through d alone, whose components are different nodes. */
bool kmp_gap_is_seen_through(kmp_gaps *s, const kmp_gap *p, const kmp_ref *h);

/** The closure's rows with its sides by two variants, derived when first used; NULL: no memory. */
const kmp_gap_version *kmp_gap_version_of(kmp_gaps *s, kmp_gap *p, kmp_gap_part what, const kmp_gap_variant by[2]);
