/* SPDX-License-Identifier: BSD-3-Clause */
/* What the analysis of block.c leaves to block_solve.c. */
#ifndef KMP_LINALG_BLOCK_INSIDE_H
#define KMP_LINALG_BLOCK_INSIDE_H

#include "linalg/block.h"

struct kmp_block {
    int n, nz, count;
    int *p, *q, *start;    /* C(i, j) = A(p[i], q[j]); block k is rows and columns start[k] .. start[k+1] - 1 */
    int *place, *block_of; /* of each column of A in C; of each column of C */
    char *due;             /* blocks that a right-hand side of few entries has reached */
    int permutation_sign;
    bool pairs; /* every block has two rows */

    double *lu; /* the dense diagonal blocks, one after another */
    int lu_size;
    int *lu_start;   /* of each block in lu */
    int *order;      /* row of C in each pivoted row */
    double *inverse; /* 1 / u_ii */
    int *pivot;

    int *off_start, *off_column; /* entries of C beside the blocks, by rows */
    double *off;
    int *target; /* entry -> place in lu, or -1 - place in off */

    double *scratch; /* 2 n: right-hand sides in pivoted order, two interleaved */
    int sign;        /* of det A; 0: the last factorisation failed */
    int *signs;      /* of the blocks' determinants */
};

#endif
