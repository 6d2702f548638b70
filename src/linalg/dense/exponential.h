/* SPDX-License-Identifier: BSD-3-Clause */
/* The exponential of a matrix. Allocates: not for hot paths. */
#pragma once

/** e (n x n) = exp(a h), column-major. 0; -1: no memory, or a number that is not finite. */
int kmp_exponential(int n, const double *a, double h, double *e);
