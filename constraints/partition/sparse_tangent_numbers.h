/* SPDX-License-Identifier: BSD-3-Clause */
/* The numbers of sparse tangents, in the order of operations of plain loops over their nonzeros. */
#pragma once

#include "constraints/partition/sparse_tangent.h"

/** v of out += Bvu s; out = -X' force. */
void kmp_sparse_tangent_spread(const kmp_sparse_tangent *z, const double *bvu, const double *s, double *out);
void kmp_sparse_tangent_project(const kmp_sparse_tangent *z, const double *x, const double *force, double *out);

/** Bvu, also as rows, and the rows of v in X, from the values of J's entries in the order of the split Jacobian and the
 * factors of Jv. */
void kmp_sparse_tangent_tangent(const kmp_sparse_tangent *z, const struct kmp_reduction *red, const double *jacobian);

/** mr (stride x stride) = X' M X from the values of M's triangle, in the order of elimination, after
 * kmp_sparse_tangent_tangent.
 */
void kmp_sparse_tangent_reduce(const kmp_sparse_tangent *z, const double *mass, double *mr);

/** Cholesky factor of mr. Returns 0, or 1 + the index in u of a pivot that is not positive. */
int kmp_sparse_tangent_factor(const kmp_sparse_tangent *z, double *mr);

/** b (p, in the order of u) <- Mr^-1 b with the factor in mr. Up to four columns, each `ld` after another, with room
 * for four times stride: the bits are the same. */
void kmp_sparse_tangent_solve(const kmp_sparse_tangent *z, const double *mr, double *b);
void kmp_sparse_tangent_solve_four(const kmp_sparse_tangent *z, const double *mr, int count, double *b, int ld,
                                   double *room);
