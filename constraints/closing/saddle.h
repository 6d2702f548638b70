/* SPDX-License-Identifier: BSD-3-Clause */
/* The saddle system of accelerations, multipliers and mass-orthogonal corrections on independent rows of h,
 *
 *     M x - J' a = -f      J x = -b
 *
 * dense in parts that share no entry, or sparse when it is large. If the evaluator uses articulated bodies, their
 * recursion has solved it. If it has products M x in place of M, coordinates are partitioned
 * (constraints/partition/reduction.h): which ones is not seen in the results, and others are taken where these come
 * near to a dead centre.
 *
 * For states without a chosen set of rows, complete pivoting of the scaled J selects the independent rows at each
 * factorisation. */
#pragma once

#include "base/arena.h"
#include "constraints/closing/close.h"
#include "constraints/evaluation/evaluator.h"
#include "constraints/partition/partition.h"
#include "constraints/partition/reduction.h"
#include "linalg/dense/dense_parts.h"
#include "linalg/sparse.h"

typedef enum kmp_saddle_kind {
    KMP_SADDLE_DENSE,
    KMP_SADDLE_SPARSE,
    KMP_SADDLE_BY_BODIES,
    KMP_SADDLE_BY_PRODUCTS
} kmp_saddle_kind;

/* Coordinates that are independent in the rows of a saddle system. */
typedef struct kmp_saddle_reduction {
    kmp_partition part;
    kmp_reduction red;
} kmp_saddle_reduction;

typedef struct kmp_saddle {
    kmp_evaluator *eval;
    const kmp_partition *part;
    int n, r;
    kmp_saddle_kind kind;
    kmp_arena arena;
    double *matrix, *x; /* the entries when sparse; otherwise none */
    kmp_dense_parts dense;
    int count, *entry_row, *entry_col; /* entries of the matrix, if there is one */
    int *entry_from;                   /* of each: an entry of M, then of J; -1: of a row that is left out */
    kmp_sparse *sparse;                /* NULL: not sparse, or singular by its pattern */
    kmp_saddle_reduction *reduction;   /* by products; NULL: otherwise */
    double *rows;                      /* m: work space by products */
    int *position;                     /* m: of a row among the independent ones, -1 when dropped */
    long factorizations;

    bool *out;         /* m: rows left out; NULL: none. The members below serve states without a chosen set of rows: */
    int rank;          /* rank near closed states; -1: the rank of each state is used */
    kmp_partition all; /* all rows */
    double *scaled, *largest, *pivots;
    int *row, *col;
} kmp_saddle;

bool kmp_saddle_init(kmp_saddle *saddle, kmp_evaluator *eval, const kmp_partition *part);
void kmp_saddle_free(kmp_saddle *saddle);

/** Prepares for any state, with rows chosen at each factorisation. `rank` (-1: unknown) belongs to closed states. Near
 * closed states redundant rows appear weakly independent, and count only if |h| leaves no doubt. */
bool kmp_saddle_init_anywhere(kmp_saddle *saddle, kmp_evaluator *eval, int rank);

/** True if a row counts at the last factorisation. */
bool kmp_saddle_has_row(const kmp_saddle *saddle, int row);

/** Factors at the evaluator's last closure and mass. 0, or nonzero when singular. */
int kmp_saddle_factor(kmp_saddle *saddle);

/** True if the elimination of the rows by bodies has not lost many digits at the last factorisation: open loops may
 * leave a motion almost without inertia, by which J M^-1 J' is divided. */
bool kmp_saddle_keeps_digits(const kmp_saddle *saddle);

/** The cost of a factorisation and a solution, whatever the way, in operations of straight code. */
double kmp_saddle_cost(const kmp_saddle *saddle);
#define KMP_LOOPS_COST 2.0 /* of an operation in the loops of dense factors, or of a reduction */

/** x (n) and a (m; zero for dropped rows; NULL: not wanted) of f (n; NULL: zero) and b (m; NULL: zero). Without f: the
 * mass-orthogonal correction x, of least qd-norm with J x = -b; by bodies only that, without a. */
void kmp_saddle_solve(kmp_saddle *saddle, const double *f, const double *b, double *x, double *a);

/** qdd and lambda (m; zero for dropped rows; NULL: not wanted) from the evaluator's last bias. Forces that depend on
 * multipliers update the bias (constraints/evaluation/load_multipliers.h); results are not finite if that fails. */
void kmp_saddle_accelerations(kmp_saddle *saddle, double *qdd, double *lambda);

/** The backward error of accelerations and multipliers (m; zero for dropped rows), however they were found: the largest
 * residual of a row of the system over the sum of the sizes of its terms, by M, C, J and jdqd of the evaluator's last
 * bias. It is some roundings where the solution is as good as the numbers of the system permit (Rigal and Gaches,
 * J. ACM 14, 1967), whatever its condition. Infinite without memory. */
double kmp_saddle_backward_error(const kmp_saddle *saddle, const double *qdd, const double *lambda);

/** True if accelerations by articulated bodies are as good as accelerations by M and C: by their relative difference,
 * or by their backward error (infinite: not known). */
bool kmp_saddle_bodies_agree(double difference, double backward_error);

/** After kmp_saddle_accelerations: kmp_load_factor with its factors, for small changes of this solution. */
bool kmp_saddle_load_factor(kmp_saddle *saddle);

/** After kmp_saddle_accelerations: kmp_load_find_other with its factors. */
bool kmp_saddle_find_other(kmp_saddle *saddle, int *row, double *value);

/** Closer along the mass-orthogonal direction; dx: n values of work space. */
kmp_closer kmp_saddle_closer(kmp_saddle *saddle, double *dx);
