/* SPDX-License-Identifier: BSD-3-Clause */
/* The result of the analysis in block.c, which block_solve.c uses. */
#ifndef KMP_LINALG_BLOCK_INSIDE_H
#define KMP_LINALG_BLOCK_INSIDE_H

#include "linalg/block.h"

struct kmp_block {
    int n, nz, count;
    int *p, *q, *start;    /* C(i, j) = A(p[i], q[j]); block k is rows and columns start[k] .. start[k+1] - 1 */
    int *place, *block_of; /* position of each column of A in C; block of each column of C */
    char *due;             /* blocks that a right-hand side of few entries has reached */
    int permutation_sign;
    bool pairs; /* every block has two rows */

    double *lu; /* the dense diagonal blocks, one after another */
    int lu_size;
    int *lu_start;   /* start of each block in lu */
    int *order;      /* row of C in each pivoted row */
    double *inverse; /* 1 / u_ii */
    int *pivot;

    int *off_start, *off_column; /* entries of C outside the blocks, by rows */
    double *off;
    int *target; /* entry -> position in lu, or -1 - position in off */

    double *scratch; /* 2 n: right-hand sides in pivoted order, two interleaved */
    int sign;        /* of det A; 0: the last factorisation failed */
    int *signs;      /* of the blocks' determinants */
};

#endif
