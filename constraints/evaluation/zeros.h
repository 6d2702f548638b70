/* SPDX-License-Identifier: BSD-3-Clause */
/* Structural zeros of X = (1; Bvu), M X and the reduced mass X' M X: a loop moves only with the coordinates that its
 * block of Jv reaches. The reduced mass is eliminated in an order of little fill. Zeros are found once for a choice of
 * u, v and rows; numbers are computed without allocation. */
#pragma once

#include "base/arena.h"
#include "constraints/partition/partition.h"
#include "linalg/block.h"

typedef struct kmp_zeros {
    const kmp_partition *part; /* not owned */
    kmp_arena *arena, scratch; /* scratch: during construction */
    int n, p, blocks;
    bool whole;                      /* the factor of the reduced mass has few zeros: it is dense, in the order of u */
    int *x_start, *x_row;            /* nonzero rows of X, by columns, ascending */
    int *b_row;                      /* these rows in Bvu: one less per column */
    char *used;                      /* by pairs of columns: the blocks of Jv that they reach */
    int *m_start, *m_row, *m_entry;  /* M by columns, both triangles */
    int *order;                      /* u in the order of elimination */
    int *mr_start, *mr_row;          /* reduced mass in that order, by columns from the diagonal down */
    int *l_start, *l_row;            /* Cholesky factor of the reduced mass, by columns below the diagonal */
    double *column, *packed;         /* n, p */
    long mass_products, x_products;  /* of M X; of X' (M X) */
    long factor_products, l_entries; /* of the factor; its non-zeros below the diagonal */
    kmp_flops solves;                /* of all columns of Bvu */
} kmp_zeros;

struct kmp_reduction;

/** Made in an arena, from a reduction with a split Jacobian. NULL if too little is zero, or without memory. */
kmp_zeros *kmp_zeros_new(const struct kmp_reduction *red, kmp_arena *arena);

/** v of out += Bvu s; out = -X' force. */
void kmp_zeros_spread(const kmp_zeros *z, const double *bvu, const double *s, double *out);
void kmp_zeros_project(const kmp_zeros *z, const double *x, const double *force, double *out);

/** mr (p x p, at its nonzeros) = X' M X from the values of M's triangle, in the order of elimination. */
void kmp_zeros_reduce(const kmp_zeros *z, const double *x, const double *mass, double *mr);

/** Cholesky factor of mr. Returns 0, or 1 + the index in u of a pivot that is not positive. */
int kmp_zeros_factor(const kmp_zeros *z, double *mr);

/** b (p, in the order of u) <- Mr^-1 b with the factor in mr. */
void kmp_zeros_solve(const kmp_zeros *z, const double *mr, double *b);
