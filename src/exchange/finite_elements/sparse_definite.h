/* SPDX-License-Identifier: BSD-3-Clause */
/* Factors of large symmetric matrices, positive definite, with much fill: by CHOLMOD where its library is installed,
 * and otherwise by KLU, which takes six times as long for a solid of 35000 displacements. */
#pragma once

#include "linalg/sparse.h"

typedef struct kmp_sparse_definite kmp_sparse_definite;

/** Factors a matrix of n rows by both triangles (row[k], col[k]), none twice, columns ascending within ascending rows.
 * It allocates: not for hot paths. KMP_SPARSE_SINGULAR: it is singular. An indefinite matrix is refused likewise, or
 * factored as it is. */
kmp_sparse_outcome kmp_sparse_definite_new(int n, int nz, const int *row, const int *col, const double *value,
                                           kmp_sparse_definite **factors);
void kmp_sparse_definite_free(kmp_sparse_definite *factors);

/** x <- A^-1 x; x is n x m, leading dimension n. False: no memory, and x is as it was. */
bool kmp_sparse_definite_solve(kmp_sparse_definite *factors, int m, double *x);

/** The library: "CHOLMOD", "KLU". */
const char *kmp_sparse_definite_library(const kmp_sparse_definite *factors);
