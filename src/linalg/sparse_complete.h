/* SPDX-License-Identifier: BSD-3-Clause */
/* Complete pivoting of a sparse matrix. */
#pragma once

#include "linalg/sparse.h"

/** Complete pivoting as kmp_lu_complete, without the factors: r, c and pivots agree to the last bit. If this order of
 * pivots would fill the matrix, entries down to a quarter of the largest are also accepted, and the entry that fills
 * least goes first. This is threshold complete pivoting (Gill, Murray, Saunders, SIAM Review 47 (2005) 99); r, c and
 * pivots are then sorted by the size of the pivots. All pivots are NaN when an entry is not finite. *products (NULL:
 * not wanted): the number of products formed. False: no memory. */
bool kmp_sparse_complete(const kmp_entries *a, const int *fixed, int *r, int *c, double *pivots, long *products);
