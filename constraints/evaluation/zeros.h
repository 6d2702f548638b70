/* SPDX-License-Identifier: BSD-3-Clause */
/* Where X = (1; Bvu), M X and the reduced mass X' M X are zero in all states: a loop moves with the coordinates that
 * its block of Jv reaches, and with no others. The reduced mass is eliminated in an order of little fill. Found once
 * for a choice of u, v and rows; numbers without allocation. */
#ifndef KMP_CONSTRAINTS_EVALUATION_ZEROS_H
#define KMP_CONSTRAINTS_EVALUATION_ZEROS_H

#include "base/arena.h"
#include "constraints/partition/partition.h"
#include "linalg/block.h"

typedef struct kmp_zeros {
    const kmp_partition *part; /* not owned */
    kmp_arena arena, scratch;  /* the second while it is made */
    int n, p, blocks;
    bool whole;                      /* the factor of the reduced mass has few zeros: it is dense, in the order of u */
    int *x_start, *x_row;            /* rows of X that are not zero, by columns, ascending */
    int *b_row;                      /* the same rows of Bvu: one less a column */
    char *used;                      /* by pairs of columns: which blocks of Jv they reach */
    int *m_start, *m_row, *m_entry;  /* M by columns, both triangles */
    int *order;                      /* u in the order of elimination */
    int *mr_start, *mr_row;          /* reduced mass in that order, by columns from the diagonal down */
    int *l_start, *l_row;            /* its factor, by columns below the diagonal */
    double *column, *packed;         /* n, p */
    long mass_products, x_products;  /* of M X; of X' (M X) */
    long factor_products, l_entries; /* of the factor; its non-zeros below the diagonal */
    kmp_flops solves;                /* of all columns of Bvu */
} kmp_zeros;

struct kmp_reduction;

/** Of a reduction whose Jacobian is split. NULL where too little is zero to gain by it, or without memory. */
kmp_zeros *kmp_zeros_new(const struct kmp_reduction *red);
void kmp_zeros_free(kmp_zeros *z);

/** v of out += Bvu s; out = -X' force. */
void kmp_zeros_spread(const kmp_zeros *z, const double *bvu, const double *s, double *out);
void kmp_zeros_project(const kmp_zeros *z, const double *x, const double *force, double *out);

/** mr (p x p, where it is not zero) = X' M X for the values of M's triangle, in the order of elimination. */
void kmp_zeros_reduce(const kmp_zeros *z, const double *x, const double *mass, double *mr);

/** Its Cholesky factor. 0, or 1 + the place in u of a pivot that is not positive. */
int kmp_zeros_factor(const kmp_zeros *z, double *mr);

/** b (p, in the order of u) <- Mr^-1 b with the factor. */
void kmp_zeros_solve(const kmp_zeros *z, const double *mr, double *b);

#endif
