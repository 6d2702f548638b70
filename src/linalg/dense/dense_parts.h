/* SPDX-License-Identifier: BSD-3-Clause */
/* Dense LU of a square matrix whose parts share no entry, as the bodies of a scene that do not touch: each part has
 * separate factors. Unknowns of a part keep their order. And parts of matrices that are stored whole. */
#pragma once

#include "base/arena.h"

typedef struct kmp_dense_parts {
    int n, count, entries; /* parts; entries of the matrix */
    int *start;            /* parts + 1: the first place of each */
    int *place;            /* n: of each unknown, in the order of the parts */
    int *at;               /* of each entry: its place in the matrices, which are one after the other */
    size_t numbers;        /* of all matrices */
    double *matrix, *x;    /* n */
    int *pivot;            /* n */
} kmp_dense_parts;

/** For entries (row[k], col[k]) of an n x n matrix without duplicates; memory of the arena. False: no memory. */
bool kmp_dense_parts_init(kmp_dense_parts *p, kmp_arena *arena, int n, int entries, const int *row, const int *col);

/** Zeroes the matrices; then entry k has its value at matrix[at[k]]. */
void kmp_dense_parts_clear(kmp_dense_parts *p);

/** Factors the values that have been set. Returns 0; nonzero: singular. */
int kmp_dense_parts_factor(kmp_dense_parts *p);

/** x <- A^-1 x. */
void kmp_dense_parts_solve(kmp_dense_parts *p, double *x);

/** Groups of unknowns that share no entry of dense matrices (`matrices` of them, n x n each; NULL: it has none). Groups
 * are in the order of their first unknowns. */
typedef struct kmp_dense_groups {
    int count;
    int *order; /* n: unknowns by groups, ascending in each */
    int *start; /* count + 1: of each group in `order` */
    int *of;    /* n: the group of each unknown */
} kmp_dense_groups;

/** Memory of the arena. False: no memory. */
bool kmp_dense_groups_init(kmp_dense_groups *groups, kmp_arena *arena, int n, int matrices,
                           const double *const *matrix);
