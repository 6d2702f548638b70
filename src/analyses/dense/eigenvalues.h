/* SPDX-License-Identifier: BSD-3-Clause */
/* Eigenvalues of dense column-major matrices, by LAPACK. They allocate: not for hot paths. */
#pragma once

/** Eigenvalues re + i im of a (n x n, lost), balanced first; conjugate pairs are adjacent, the positive imaginary part
 * first. Right and left vectors a v = s v, w^H a = s w^H are columns of their parts (n x n each), of norm 1. 0; -1: no
 * memory, or the iteration did not converge. */
int kmp_eigen_general(int n, double *a, double *re, double *im, double *v_re, double *v_im, double *w_re, double *w_im);

/** Eigenvalues of a complex a (n x n, lost) in `values` (n), in no order; real and imaginary part of each entry and
 * value are adjacent. 0; -1: no memory, or the iteration did not converge. */
int kmp_eigen_complex(int n, double *a, double *values);

/** k x = mu m x for symmetric k and positive m (n x n; lower triangles are read; both lost: k becomes the vectors, x' m
 * x = 1). Values ascend. 0; -1: no memory or no convergence; i + 1: minor i of m is not positive. */
int kmp_eigen_symmetric(int n, double *k, double *m, double *values);
