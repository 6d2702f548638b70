/* SPDX-License-Identifier: BSD-3-Clause */
/* The implicit equations of motion and their exact tangents, as two programs. They make up the rows and iteration
 * matrices of the dae formulation's forms, and the Jacobian of the reduced formulation. The residual follows Fisette
 * and Samin 1996 (eqs. 11-14, 25, 27), with the closures and their derivatives:
 *
 *     R = M qdd + C - J' lambda      h      rate = J qd + h_t      curve = J qdd + gamma      J' mu
 */
#pragma once

#include "base/arena.h"
#include "constraints/evaluation/evaluation_point.h"
#include "dynamics/tangents.h"
#include "model/data/force.h"

/** Values: n each for R and J' mu, m for closures, 1 for the power. */
typedef enum kmp_value {
    KMP_VALUE_R,
    KMP_VALUE_JTMU,
    KMP_VALUE_H,
    KMP_VALUE_RATE,
    KMP_VALUE_CURVE,
    KMP_VALUE_POWER, /* of the non-conservative forces */
    KMP_VALUES
} kmp_value;

/** Values that determine the linearisation about a state. */
enum { KMP_TANGENTS_NEAR = 1 << KMP_VALUE_R | 1 << KMP_VALUE_RATE | 1 << KMP_VALUE_CURVE };

/** Blocks of derivatives of the values. M and J have names, because several blocks share them. */
typedef enum kmp_tangent_block {
    KMP_R_Q,
    KMP_R_QD,
    KMP_JTMU_Q,
    KMP_RATE_Q,
    KMP_CURVE_Q,
    KMP_CURVE_QD,
    KMP_POWER_Q,
    KMP_POWER_QD,
    KMP_M, /* both triangles */
    KMP_J,
    KMP_C_LAMBDA, /* n x m: R by lambda, without -J', for forces that depend on multipliers; with only the programs */
    KMP_TANGENT_BLOCKS
} kmp_tangent_block;

typedef struct kmp_tangents {
    kmp_formulas value, tangent;
    int n, m;
    int at[KMP_VALUES];                /* first output of each value, -1 when it was not requested */
    int start[KMP_TANGENT_BLOCKS + 1]; /* entries by block, in each by column and row */
    kmp_tangent *entry;
    int *column; /* by blocks, from first_column on: the first entry of each column, and the end of the last */
    int first_column[KMP_TANGENT_BLOCKS];
    const kempe_system *forced;             /* has a user-defined force, unknown to the programs; NULL: there is none */
    double *effort, *moved;                 /* n: that force, not finite if it fails; at a displaced state */
    double *state;                          /* 2 n: q, qd */
    double *with_effort, *tangents_with_it; /* outputs of the programs including that force */
    int first_effort;                       /* source of the force's first tangent */
    kmp_arena arena;                        /* of the arrays here and of `column` */
    /* Other derivatives in place of the programs, for the same entries; numbers NULL: none. */
    void *numbers;
    const double *(*by_numbers)(void *numbers, const kmp_instant *at);
    kmp_tangent_choice choice; /* R by composite bodies (0) or by differentiation (1); operations, 0: not counted */
} kmp_tangents;

/** Requests the program of the values too, in addition to the program of their derivatives. */
enum { KMP_TANGENTS_WITH_VALUES = 1 << (KMP_VALUES + 1) };

/** `values` has bit 1 << kmp_value for each requested value, and KMP_TANGENTS_WITH_VALUES; J and M are always included.
 * KEMPE_E_MEMORY. */
kempe_status kmp_tangents_init(kmp_tangents *tangents, const kempe_system *system, const kmp_backend *backend,
                               unsigned values);
void kmp_tangents_free(kmp_tangents *tangents);

/** KMP_TANGENTS_NEAR, with the power where forces dissipate: what reduced runs take. Who linearises a system before a
 * run of it takes them, too, so that they are derived once. */
unsigned kmp_tangents_of_runs(const kempe_system *system);

/** Sorts the entries of a list, which it takes, by their place; then lists the first entry of each column. false: no
 * memory. */
void kmp_tangents_sort(kmp_tangents *tangents, kmp_listing *list);
bool kmp_tangents_list_columns(kmp_tangents *tangents);

/** Prepares the program of the values, which must have been requested, for kmp_tangents_values. KEMPE_E_MEMORY. */
kempe_status kmp_tangents_add_values(kmp_tangents *tangents, const kempe_system *system, const kmp_backend *backend);

/** All values; all tangent outputs (entry e is [e.source]). Valid until the next call; no allocation. */
const double *kmp_tangents_values(kmp_tangents *tangents, const kmp_instant *at);
const double *kmp_tangents_derivatives(kmp_tangents *tangents, const kmp_instant *at);

/** out += factor * block * x for the derivatives `d` last evaluated; columns with zero x are left out. */
void kmp_tangents_add(const kmp_tangents *tangents, kmp_tangent_block block, const double *d, double factor,
                      const double *x, double *out);

/** out += the transpose of the block * w. */
void kmp_tangents_add_transposed(const kmp_tangents *tangents, kmp_tangent_block block, const double *d,
                                 const double *w, double *out);
