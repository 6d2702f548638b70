/* SPDX-License-Identifier: BSD-3-Clause */
/* Eigenvalues and eigenvectors of symmetric matrices (LAPACK dsyev). Allocates: not for hot paths. */
#ifndef KMP_LINALG_DENSE_SYMMETRIC_H
#define KMP_LINALG_DENSE_SYMMETRIC_H

/** a (n x n, column-major, its lower triangle is read) becomes its eigenvectors as columns; values ascend. 0; -1: no
 *  memory, or the iteration did not converge (it does for finite entries). */
int kmp_symmetric_eigen(int n, double *a, double *values);

#endif
