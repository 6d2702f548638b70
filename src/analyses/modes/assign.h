/* SPDX-License-Identifier: BSD-3-Clause */
/* The assignment problem: the assignment of least sum, by shortest augmenting paths (Kuhn 1955, Munkres 1957; Jonker
 * and Volgenant 1987). */
#pragma once

/** cost[i + j*n], finite, is the cost of giving column j to row i; column[i] becomes the column of row i. Among equal
 * sums the choice is deterministic. 0; -1: no memory. */
int kmp_assign(int n, const double *cost, int *column);
