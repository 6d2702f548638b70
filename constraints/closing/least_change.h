/* SPDX-License-Identifier: BSD-3-Clause */
/* Closing the loops by least changes of the scaled coordinates,
 *
 *     dq = S J' y      (J J' + mu^2) y = -h      J scaled, mu = |h| or more.
 *
 * Redundant rows, whose rank is undecided before h is closed, then cause no large steps. Convergence to the nearest
 * closed state remains quadratic (Yamashita and Fukushima, Computing Suppl. 15 (2001) 239). J is dense; a large one
 * is factored sparse as [1 -J'; J mu^2]. */
#pragma once

#include "base/arena.h"
#include "constraints/closing/close.h"
#include "constraints/closing/rotation_vectors.h"
#include "linalg/sparse.h"

typedef struct kmp_least_change {
    kmp_evaluator *eval;           /* not owned */
    kmp_rotation_vectors *vectors; /* not owned: rows of closures that align axes are these; NULL: their own */
    const bool *hold;              /* n, not owned: coordinates that stay; NULL: none */
    double *entry;       /* entries of the scaled J, in its order; zero for held coordinates and for rows that need not
                          * be met */
    int *start, *column; /* n + 1; entries column by column */
    double *right;       /* n + m */
    double *dx;          /* n */
    double *matrix;      /* m x m; values when sparse */
    double damping;      /* damping of the last factorisation */
    kmp_sparse *sparse;
    kmp_arena arena;
} kmp_least_change;

/** Allocates all memory; false: no memory. */
bool kmp_least_change_init(kmp_least_change *least, kmp_evaluator *eval);
void kmp_least_change_free(kmp_least_change *least);

kmp_closer kmp_least_change_closer(kmp_least_change *least);

/** Rule of convergence in which long corrections are cut. */
kmp_close_rule kmp_least_change_rule(int most);
