/* SPDX-License-Identifier: BSD-3-Clause */
/* The exact Jacobian of the reduced right-hand side, from the responses to changes of each unknown
 * (constraints/partition/small_change.h). */
#pragma once

#include "base/arena.h"
#include "constraints/partition/reduction.h"
#include "constraints/partition/small_change.h"

typedef struct kmp_reduced_jacobian {
    kmp_arena arena; /* of all arrays */
    kmp_tangents tangents;
    kmp_reduction *red;   /* not owned */
    double *qdd, *lambda; /* n, m */
    int pieces, columns;  /* pieces of work, of this number of columns each */
    double *room;         /* of all pieces, one after another */
    size_t room_of_piece;
} kmp_reduced_jacobian;

kempe_status kmp_reduced_jacobian_init(kmp_reduced_jacobian *jacobian, kmp_reduction *red);
void kmp_reduced_jacobian_free(kmp_reduced_jacobian *jacobian);

/** j = d(ud, udd[, power]) / d(u, ud[, work]), column-major of leading dimension `size`, zeroed before, at a state
 * where the reduction has factors, tangent and the accelerations udd. The last row excludes the power of moving
 * closures, and the effect of multipliers on the power of forces. No allocation. */
void kmp_reduced_jacobian_eval(kmp_reduced_jacobian *jacobian, double t, const double *q, const double *qd,
                               const double *udd, int size, double *j);

/** j = dF/d(u, ud[, work]) + cj dF/d(u', ud'[, work']), column-major as in kmp_reduced_jacobian_eval, of F = (u' - ud,
 * X' (M qdd + C)[, work' - power]) at ud' = udd, where the reduction has factors, tangent and a0, the evaluator M and
 * C. */
void kmp_reduced_jacobian_of_residual(kmp_reduced_jacobian *jacobian, double t, double cj, const double *q,
                                      const double *qd, const double *udd, int size, double *j);
