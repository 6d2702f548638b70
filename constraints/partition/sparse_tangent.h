/* SPDX-License-Identifier: BSD-3-Clause */
/* Structural zeros of X = (1; Bvu), M X and the reduced mass X' M X: a loop moves only with the coordinates that its
 * block of Jv reaches. The reduced mass is eliminated in an order of little fill. Zeros are found once for a choice of
 * u, v and rows; numbers are computed without allocation, four columns at once. */
#pragma once

#include "base/arena.h"
#include "base/simd4.h"
#include "constraints/partition/partition.h"
#include "linalg/block.h"

/* Lists of numbers: `list` k is at[start[k]] .. at[start[k + 1] - 1], ascending. */
typedef struct kmp_lists {
    int *start, *at;
} kmp_lists;

/* Runs of positions from at[2 e] to before at[2 e + 1], both multiples of four, for e as in kmp_lists. */
typedef kmp_lists kmp_runs;

/* A position is the place of a u in the order of elimination. A four is four positions, 4 k .. 4 k + 3; arrays over
 * positions are `stride` long, a multiple of four. */
typedef struct kmp_sparse_tangent {
    const kmp_partition *part; /* not owned */
    kmp_arena *arena, scratch; /* scratch: during construction */
    int n, p, blocks, stride;
    bool whole;                       /* the factor of the reduced mass has few zeros: it is dense, in the order of u */
    int *x_start, *x_row;             /* nonzero rows of X, by columns, ascending */
    int *b_row;                       /* these rows in Bvu: one less per column */
    int *order;                       /* u in the order of elimination */
    int *place;                       /* position of a coordinate among u; -1 - its index in v */
    int *block_of;                    /* the block of Jv of each v */
    kmp_lists reach;                  /* positions that move the v of each block of Jv */
    kmp_runs reach_runs;              /* fours of them */
    int *ju_place;                    /* of each entry of Ju in `right` */
    double *right, *b;                /* r x stride by rows: -Ju, and Bvu */
    int *in_b, *in_bvu, *in_x;        /* places of the nonzeros of Bvu: x_start[p] - p of them */
    int *m_start, *m_place, *m_entry; /* M by rows, both triangles: place of the column's coordinate */
    kmp_runs mx_runs;                 /* of each row of M X */
    double *row;                      /* stride: a row of M X */
    kmp_lists l;                      /* Cholesky factor of the reduced mass, by columns below the diagonal */
    kmp_lists tiles;                  /* fours of its rows, by fours of its columns, from the diagonal down */
    double *packed;                   /* stride: a solution */
    long mass_products, x_products;   /* of M X; of X' (M X) */
    long factor_products, l_entries;  /* of the factor; its non-zeros below the diagonal */
    kmp_flops solves;                 /* of all columns of Bvu */
} kmp_sparse_tangent;

struct kmp_reduction;

static inline int kmp_sparse_tangent_stride(int p)
{
    return (p + KMP_FOUR - 1) / KMP_FOUR * KMP_FOUR;
}

/** Made in an arena, from a reduction with a split Jacobian. NULL if too little is zero, or without memory. */
kmp_sparse_tangent *kmp_sparse_tangent_new(const struct kmp_reduction *red, kmp_arena *arena);

/** Products of the reduced mass and its factor. */
static inline long kmp_sparse_tangent_products(const kmp_sparse_tangent *z)
{
    return z->mass_products + z->x_products + z->factor_products;
}

/** Rows of Bvu's column k that may not be zero; returns their number. */
static inline int kmp_sparse_tangent_rows(const kmp_sparse_tangent *z, int k, const int **row)
{
    *row = z->b_row + (z->x_start[k] - k);
    return z->x_start[k + 1] - z->x_start[k] - 1;
}

/** v of out += Bvu s; out = -X' force. */
void kmp_sparse_tangent_spread(const kmp_sparse_tangent *z, const double *bvu, const double *s, double *out);
void kmp_sparse_tangent_project(const kmp_sparse_tangent *z, const double *x, const double *force, double *out);

/** Bvu, also as rows, and the rows of v in X, from the values of J's entries in the order of the split Jacobian and the
 * factors of Jv. */
void kmp_sparse_tangent_tangent(const kmp_sparse_tangent *z, const struct kmp_reduction *red, const double *jacobian);

/** mr (stride x stride) = X' M X from the values of M's triangle, in the order of elimination, after
 * kmp_sparse_tangent_tangent.
 */
void kmp_sparse_tangent_reduce(const kmp_sparse_tangent *z, const double *mass, double *mr);

/** Cholesky factor of mr. Returns 0, or 1 + the index in u of a pivot that is not positive. */
int kmp_sparse_tangent_factor(const kmp_sparse_tangent *z, double *mr);

/** b (p, in the order of u) <- Mr^-1 b with the factor in mr. Up to four columns, each `ld` after another, with room
 * for four times stride: the bits are the same. */
void kmp_sparse_tangent_solve(const kmp_sparse_tangent *z, const double *mr, double *b);
void kmp_sparse_tangent_solve_four(const kmp_sparse_tangent *z, const double *mr, int count, double *b, int ld,
                                   double *room);
