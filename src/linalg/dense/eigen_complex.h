/* SPDX-License-Identifier: BSD-3-Clause */
/* Eigenvalues of small complex matrices (LAPACK zgeev). Allocates: not for hot paths. */
#ifndef KMP_LINALG_DENSE_EIGEN_COMPLEX_H
#define KMP_LINALG_DENSE_EIGEN_COMPLEX_H

/** a (n x n, column-major, real and imaginary part of an entry side by side, lost) has the eigenvalues in `values` (n,
 *  likewise), in no order. 0; -1: no memory, or the iteration did not converge. */
int kmp_eigen_complex(int n, double *a, double *values);

#endif
