/* SPDX-License-Identifier: BSD-3-Clause */
/* Coordinate partitioning at one state: Jv factored block by block, qd = X ud + x_t with X = (1; Bvu), the reduced mass
 * and force (Fisette and Samin 1996, eqs. 43-46), the closure by Newton's method, the multipliers. Workspace of one
 * thread; no allocation after kmp_reduction_init. */
#pragma once

#include "base/arena.h"
#include "constraints/evaluation/evaluator.h"
#include "constraints/partition/partition.h"
#include "constraints/partition/sparse_tangent.h"
#include "linalg/block.h"

typedef struct kmp_reduction {
    kmp_evaluator *eval;       /* not owned */
    const kmp_partition *part; /* not owned */
    kmp_arena arena;
    int n, p, r;
    kmp_block *block;          /* Jv; NULL when r = 0 */
    kmp_sparse_tangent *zeros; /* NULL: X counts as dense */
    int jv_count, ju_count;
    int *jv_entry, *jv_row, *jv_col; /* of the evaluator's Jacobian values, position in rows, position in v */
    int *ju_entry, *ju_row, *ju_col; /* entry, position in rows, position in u */
    int *place;                      /* position of a coordinate in v; -1 - that in u */
    int *row_of;                     /* position of a row of h among the independent rows, -1 when dropped */
    double *jv;                      /* values */
    double *bvu;                     /* r x p, column-major: Bvu = -Jv^-1 Ju, unscaled */
    double *x;                       /* n x p, column-major */
    double *x_t;                     /* n: part of qd due to h_t */
    double *a0;                      /* n: qdd at udd = 0 */
    double *force;                   /* n: C + M a0 */
    double *mx;                      /* n x p, or n: M X (without zeros), or qdd */
    double *mr;                      /* p x p (zeros: of their stride): reduced mass, then its factor */
    double *dv;                      /* r: the last correction or right-hand side */
    double *answer;                  /* p: work space for forces that depend on multipliers */
    double *room;                    /* 2 r: a right-hand side, and its solution */
    int fault;                       /* of the reduced mass: 0, or 1 + the index in u of a pivot that is not positive */
    long newton, factorizations;
} kmp_reduction;

/** KEMPE_E_MEMORY, or KEMPE_E_FAILED when Jv is structurally singular. */
kempe_status kmp_reduction_init(kmp_reduction *red, kmp_evaluator *eval, const kmp_partition *part);
void kmp_reduction_free(kmp_reduction *red);

/** Factors Jv of the evaluator's last closure. 0, or 1 + the coordinate of the singular column. */
int kmp_reduction_factor(kmp_reduction *red);

/** Bvu, X and x_t from the factors. */
void kmp_reduction_tangent(kmp_reduction *red);

/** qd = X ud + x_t. */
void kmp_reduction_rates(const kmp_reduction *red, const double *ud, double *qd);

/** qd = X ud + x_t by one solution with the factors, without the tangent. */
void kmp_reduction_rates_alone(kmp_reduction *red, const double *ud, double *qd);

/** Reduced accelerations at qd from the evaluator's M, C, jdqd: eq. (46). 0, or 1 + k when the reduced mass is not
 * positive for u[k]. Forces that depend on multipliers are solved for (constraints/evaluation/load_multipliers.h);
 * results are not finite if that fails. */
int kmp_reduction_accelerate(kmp_reduction *red, double *udd);

/** C and jdqd at qd (kmp_eval_bias), after kmp_eval_mass, and the reduced accelerations. With a thread pool the reduced
 * mass is computed in parallel with C. */
int kmp_reduction_move(kmp_reduction *red, const double *qd, double *udd);

/** The reduced mass and its factors from X, and from the evaluator's M or products with it. 0, or 1 + k when it is not
 * positive for u[k]. */
int kmp_reduction_factor_mass(kmp_reduction *red);

/** x (n) and a (m; zero for dropped rows; NULL: not wanted) of M x - J' a = -f, J x = -b, for f (n; NULL: zero) and b
 * (m; NULL: zero), after kmp_reduction_factor_mass: J is solved for v, and X' eliminates a. */
void kmp_reduction_solve_saddle(kmp_reduction *red, const double *f, const double *b, double *x, double *a);

/** b (p) <- Mr^-1 b, after kmp_reduction_accelerate. */
void kmp_reduction_solve_mass(const kmp_reduction *red, double *b);

/** As kmp_reduction_solve_mass for `count` columns, each `ld` after another, with the same bits. Room: 4 (p + 3). Other
 * threads may solve at the same time, with other room. */
void kmp_reduction_solve_masses(const kmp_reduction *red, int count, double *b, int ld, double *room);

/** out (p) = -X' force (n). */
void kmp_reduction_project(const kmp_reduction *red, const double *force, double *out);

/** out = X' (M qdd + C) at qdd = X udd + a0, from the evaluator's M, C, jdqd, without the reduced mass. Forces that
 * depend on multipliers take the multipliers of these accelerations; results are not finite if that fails. */
void kmp_reduction_residual(kmp_reduction *red, const double *udd, double *out);

/** qdd = X udd + a0 after kmp_reduction_accelerate or kmp_reduction_residual. */
void kmp_reduction_accelerations(const kmp_reduction *red, const double *udd, double *qdd);

/** out_v += factor Jv^-1 rows, for all m given rows; with other room of 2 r than red->room, other threads may do it at
 * the same time. */
void kmp_reduction_push_in(const kmp_reduction *red, double factor, const double *rows, double *room, double *out);

/** rows (m; zero where dropped) = Jv'^-1 force_v. */
void kmp_reduction_pull(kmp_reduction *red, const double *force, double *rows);

/** Small changes of C near a state where it is at its multipliers (kmp_load_factor, kmp_load_change). `moving`:
 * accelerations change with C, as after kmp_reduction_accelerate; otherwise they are constant, as after
 * kmp_reduction_residual. `bias` may be red->force. */
bool kmp_reduction_load_factor(kmp_reduction *red, bool moving);
void kmp_reduction_load_change(kmp_reduction *red, bool moving, double *bias);

/** Its transpose, of constant accelerations: weights on C (n) at its multipliers become weights on C at constant ones.
 * `rows`: room for m. */
void kmp_reduction_load_change_back(kmp_reduction *red, double *rows, double *weights);

/** lambda (m; zero for dropped rows) from Jv' lambda = (M qdd + C)_v. */
void kmp_reduction_multipliers(kmp_reduction *red, const double *qdd, double *lambda);

/** dv = -Jv^-1 h from the evaluator's last h and the present factors, in red->dv. */
void kmp_reduction_correction(kmp_reduction *red);

/** Scaled change of v when each independent row opens by its scale, with signs of a fixed sequence: in general of the
 * size of one over the last pivot of the scaled Jv. */
double kmp_reduction_lever(kmp_reduction *red);

/** Motion of dropped rows with column k of X: the largest |J_r X_k| / row scale at the evaluator's last closure, over
 * rows that are not left out (m; NULL: none is). */
double kmp_reduction_slip(const kmp_reduction *red, int k, const bool *left_out);

/** Operation count of one right-hand side without the program: kmp_reduction_factor, _tangent, _rates, _accelerate;
 * square roots count as `other`. */
kmp_counts kmp_reduction_count(const kmp_reduction *red);

/** max |Bvu|, scaled, and its v and u. */
double kmp_reduction_growth(const kmp_reduction *red, int *v, int *u);
