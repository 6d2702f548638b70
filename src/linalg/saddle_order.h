/* SPDX-License-Identifier: BSD-3-Clause */
/* An order of elimination of [A -J'; J D], A positive definite, in which the diagonal serves as pivots: the rows of J
 * of a group, such as a closure, are eliminated at once after as many coordinates that they can be solved for. An
 * order of least degree that knows nothing of this begins with multipliers, whose pivots are zero. */
#pragma once

#include <stdbool.h>
#include <stdint.h>

/** Entries (row[k], col[k]) of the symmetric pattern, of n coordinates and then r multipliers; group (r): equal numbers
 * for the rows of a group, ascending. order (n + r): the unknowns in the order of elimination. False: no memory. */
bool kmp_saddle_order(int n, int r, int nz, const int *row, const int *col, const int *group, int64_t *order);
