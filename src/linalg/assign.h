/* SPDX-License-Identifier: BSD-3-Clause */
/* Which goes with which: the assignment of least sum, by shortest augmenting paths (Kuhn 1955, Munkres 1957; Jonker and
 * Volgenant 1987). */
#ifndef KMP_LINALG_ASSIGN_H
#define KMP_LINALG_ASSIGN_H

/** cost[i + j*n] of giving column j to row i, finite; column[i] becomes the one of row i. Of equal sums always the same
 *  is taken. 0; -1: no memory. */
int kmp_assign(int n, const double *cost, int *column);

#endif
