/* SPDX-License-Identifier: BSD-3-Clause */
/* Eigenvalues of small complex matrices (LAPACK zgeev). Allocates: not for hot paths. */
#ifndef KMP_LINALG_DENSE_EIGEN_COMPLEX_H
#define KMP_LINALG_DENSE_EIGEN_COMPLEX_H

/** Eigenvalues of a (n x n, column-major, lost) in `values` (n), in no order; real and imaginary part of each entry and
 * value are adjacent. 0; -1: no memory, or the iteration did not converge. */
int kmp_eigen_complex(int n, double *a, double *values);

#endif
