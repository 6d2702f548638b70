/* SPDX-License-Identifier: BSD-3-Clause */
/* The result of the analysis in block.c, which block_solve.c uses. */
#ifndef KMP_LINALG_BLOCK_INSIDE_H
#define KMP_LINALG_BLOCK_INSIDE_H

#include "base/arena.h"
#include "linalg/block.h"

struct kmp_block {
    kmp_arena arena;
    int n, nz, count;
    int *p, *q, *start;     /* C(i, j) = A(p[i], q[j]); block k is rows and columns start[k] .. start[k+1] - 1 */
    int *place, *row_place; /* positions of each column and row of A in C */
    int *block_of;          /* block of each column of C */
    char *due;              /* blocks that a right-hand side of few entries has reached */
    bool pairs;             /* every block has two rows */

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
    bool factored;   /* the last factorisation has not failed */
    int *signs;      /* of the blocks' determinants */
};

#endif
