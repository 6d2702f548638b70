/* SPDX-License-Identifier: BSD-3-Clause */
/* The exponential of a dense matrix. */
#pragma once

/** e (n x n) = exp(a h), column-major. 0; -1: no memory, or a number that is not finite. Allocates: not for hot paths.
 */
int kmp_exponential(int n, const double *a, double h, double *e);
