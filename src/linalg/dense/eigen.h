/* SPDX-License-Identifier: BSD-3-Clause */
/* Eigenvalues and eigenvectors of general and of symmetric matrices, by LAPACK. Allocates: not for hot paths. */
#ifndef KMP_LINALG_DENSE_EIGEN_H
#define KMP_LINALG_DENSE_EIGEN_H

/** a (n x n, column-major, lost) has the eigenvalues re + i im, conjugate pairs side by side, the positive one first;
 *  right and left vectors a v = s v, w^H a = s w^H as columns of their parts (n x n each), of norm 1. Balanced first.
 * 0; -1: no memory, or the iteration did not converge. */
int kmp_eigen_general(int n, double *a, double *re, double *im, double *v_re, double *v_im, double *w_re, double *w_im);

/** k x = mu m x for symmetric k and positive m (n x n, lower triangles are read; both lost: k becomes the vectors,
 *  x' m x = 1); values ascend. 0; -1: no memory or no convergence; i + 1: minor i of m is not positive. */
int kmp_eigen_symmetric(int n, double *k, double *m, double *values);

#endif
