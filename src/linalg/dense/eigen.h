/* SPDX-License-Identifier: BSD-3-Clause */
/* Eigenvalues and eigenvectors of general and of symmetric matrices, by LAPACK. Allocates: not for hot paths. */
#ifndef KMP_LINALG_DENSE_EIGEN_H
#define KMP_LINALG_DENSE_EIGEN_H

/** Eigenvalues re + i im of a (n x n, column-major, lost), balanced first; conjugate pairs are adjacent, the positive
 * imaginary part first. Right and left vectors a v = s v, w^H a = s w^H are columns of their parts (n x n each), of
 * norm 1. 0; -1: no memory, or the iteration did not converge. */
int kmp_eigen_general(int n, double *a, double *re, double *im, double *v_re, double *v_im, double *w_re, double *w_im);

/** k x = mu m x for symmetric k and positive m (n x n; lower triangles are read; both lost: k becomes the vectors, x' m
 * x = 1). Values ascend. 0; -1: no memory or no convergence; i + 1: minor i of m is not positive. */
int kmp_eigen_symmetric(int n, double *k, double *m, double *values);

#endif
