/* SPDX-License-Identifier: BSD-3-Clause */
/* L D L' of a sparse symmetric matrix of expressions, written out without zeros. The order of elimination is that of
 * least degree (Tinney and Walker, Proc. IEEE 55 (1967) 1801), its fill is known before.
 *
 * Trailing unknowns may have a zero diagonal, as the multipliers of [M J'; J 0]. Each is eliminated after the leading
 * ones that it is coupled with, so that its pivot is that of the Schur complement -J M^-1 J'. */
#pragma once

#include "base/arena.h"
#include "symbolic/graph.h"

typedef struct kmp_writer_ldl {
    int size, leading;
    int *order, *step;         /* unknown of each step, and the reverse */
    int *start, *row;          /* L by columns, which are steps: unknowns of later steps, in their order */
    int *row_start, *col, *at; /* L by rows, which are unknowns: earlier steps, ascending, and their entry in `row` */
    long operations;           /* of the factors and one solution */
    kmp_ref *l, *scaled;       /* L, L D, as `row` */
    kmp_ref *diagonal, *pivot; /* by unknowns: of the matrix or its Schur complement; D */
    kmp_ref *inverse;          /* of D */
} kmp_writer_ldl;

/** Finds the order and the fill from a pattern (size x size, nonzero where an entry is), which is destroyed. False: no
 * memory. */
bool kmp_writer_ldl_analyse(kmp_writer_ldl *ldl, kmp_arena *arena, int size, int leading, unsigned char *pattern);

/** Writes the factors of a matrix (size x size, symmetric) of that pattern. False: no memory, or a pivot is zero. */
bool kmp_writer_ldl_factor(kmp_writer_ldl *ldl, kmp_arena *arena, kmp_graph *g, const kmp_ref *matrix);

/** x <- A^-1 x, with all unknowns; or with the leading part of A, which no trailing unknown changes. */
void kmp_writer_ldl_solve(const kmp_writer_ldl *ldl, kmp_graph *g, int unknowns, kmp_ref *x);
