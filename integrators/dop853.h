/* SPDX-License-Identifier: BSD-3-Clause */
/* DOP853: explicit Runge-Kutta of order 8 with the combined 5th/3rd-order error estimate and dense output of
 * order 7. Hairer, Norsett, Wanner, Solving Ordinary Differential Equations I, 2nd ed., II.5, II.6. */
#ifndef KMP_INTEGRATORS_DOP853_H
#define KMP_INTEGRATORS_DOP853_H

#include "integrators/ode.h"

typedef struct kmp_dop853 kmp_dop853;

/** The problem and the tolerance's arrays must outlive the integrator. NULL when there is no memory. */
kmp_dop853 *kmp_dop853_new(const kmp_ode *ode, kmp_tolerance tolerance);
void kmp_dop853_free(kmp_dop853 *s);

/** Begins at (t, y) towards t_end; h0 = 0 lets it choose the first step (Hairer's hinit). Returns KMP_GO, or what rhs
 *  said. */
int kmp_dop853_start(kmp_dop853 *s, double t, const double *y, double t_end, double h0);

/** One accepted step, not beyond t_end (the last step ends exactly there). KMP_GO; KMP_HALT when the road gave
 *  up; KMP_RETRY when the step has become too small for t (|h| < 16 eps |t|), when more than 100 steps in a row
 *  would each have to be made 1e9 times to reach t_end, or when max_reject consecutive
 *  rejections (1000) were made. */
int kmp_dop853_step(kmp_dop853 *s);

/** The last accepted step went from t_old to t; y and dy there, owned by the integrator. */
double kmp_dop853_t(const kmp_dop853 *s);
double kmp_dop853_t_old(const kmp_dop853 *s);
const double *kmp_dop853_y(const kmp_dop853 *s);
const double *kmp_dop853_dy(const kmp_dop853 *s);

/** y at t_old <= t <= t of the last step. The first call in a step evaluates rhs three times (state kept: a
 *  road that remembers its last evaluation must not rely on it being the step's end after this). Returns KMP_GO or
 *  what rhs said. */
int kmp_dop853_dense(kmp_dop853 *s, double t, double *y);

kmp_ode_work kmp_dop853_work(const kmp_dop853 *s);

#endif
