/* SPDX-License-Identifier: BSD-3-Clause */
/* Moving on the closed configurations of a mechanism at t = 0: the scaled J, its null spaces, projection back. One
 * workspace; nothing is allocated after kmp_walk_new. */
#pragma once

#include "constraints/closing/least_change.h"
#include "dynamics/system.h"
#include <stdbool.h>

typedef struct kmp_walk {
    const kempe_system *system;
    kmp_evaluator *eval;
    kmp_arena arena;
    const bool *hold;     /* n: fixed coordinates; NULL: none */
    const bool *excluded; /* m: rows to be ignored; NULL: none */
    int n, m;
    int rank;         /* rank of J for a system of rounded numbers, or one treated as rounded; -1: by pivots */
    bool *dropped;    /* m: rows that are dependent but for rounding, during kmp_walk_close */
    double *scale;    /* n: units of coordinates, kmp_walk_unit */
    double *jacobian; /* m x n, scaled, of the last kmp_walk_evaluate */
    double *h;        /* m, scaled */
    double last;      /* the last kept pivot of the last kmp_walk_tangents */
    double *copy;     /* max(m, n)^2 */
    double *basis;    /* max(m, n)^2 */
    kmp_least_change least;
    int *order;      /* max(m, n) */
    int *row_order;  /* max(m, n) */
    double *pivots;  /* m + n */
    double *largest; /* n: scratch of the pivots */
} kmp_walk;

/** The unit of coordinate k: deflections go as far as other coordinates do. */
double kmp_walk_unit(const kempe_system *system, int k);

/** Makes a walk; NULL: no memory. */
kmp_walk *kmp_walk_new(const kempe_system *system);
/** kmp_walk_new_of_closures: without the dynamics (kmp_eval_new_of_closures). */
kmp_walk *kmp_walk_new_of_closures(const kempe_system *system);
void kmp_walk_free(kmp_walk *walk);

/** Evaluates h and J, both scaled, at q; columns of J of held coordinates are zero. */
void kmp_walk_evaluate(kmp_walk *walk, const double *q);

/** Closes q by least (scaled) changes; false: not closed. J then belongs to q. */
bool kmp_walk_close(kmp_walk *walk, double *q);

/** Null space of the last J as columns of walk->basis (n x d, scaled coordinates, each of unit length); returns the
 * rank r, at most `most`, so that d = n - r. */
int kmp_walk_tangents(kmp_walk *walk, int most);

/** Computes a basis of the null space of walk->copy (rows x cols, column-major, destroyed) in walk->basis, in
 * echelon form. Column k (cols x (cols - rank)) has a one where the others have zeros. Complete pivoting; a pivot
 * below `tolerance` of the first counts as zero, and at most `most` are taken. Returns the rank; walk->last is the
 * last pivot taken. */
int kmp_walk_null_space(kmp_walk *walk, int rows, int cols, double tolerance, int most);

/** Computes the left null space of the last J, as kmp_walk_null_space does. */
int kmp_walk_left(kmp_walk *walk, double tolerance, int most);

/** The min(m, n) pivots of the last J; walk->row_order has their rows. */
void kmp_walk_pivots(kmp_walk *walk, double *pivots);

/** The largest difference of a coordinate, scaled. */
double kmp_walk_distance(const kmp_walk *walk, const double *a, const double *b);

/** Moves from `from` (n) along a random tangent to `to`, closed; `direction` (n): scratch. false if closing always
 * undoes the motion. */
bool kmp_walk_wander(kmp_walk *walk, const double *from, unsigned *state, double *direction, double *to);

/** The next number of a fixed sequence, in -1 .. 1. */
double kmp_walk_random(unsigned *state);
