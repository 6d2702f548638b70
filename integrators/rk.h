/* SPDX-License-Identifier: BSD-3-Clause */
/* Explicit Runge-Kutta methods with error control, dense output and a say of the road at every step. */
#ifndef KMP_INTEGRATORS_RK_H
#define KMP_INTEGRATORS_RK_H

#include "integrators/ode.h"

typedef struct kmp_rk kmp_rk;
typedef struct kmp_rk_method kmp_rk_method;

extern const kmp_rk_method kmp_dop853; /* order 8, dense output of order 7 */
extern const kmp_rk_method kmp_dopri5; /* order 5, dense output of order 4 */

/** The problem and the tolerance's arrays must outlive the integrator. NULL when there is no memory. */
kmp_rk *kmp_rk_new(const kmp_rk_method *method, const kmp_ode *ode, kmp_tolerance tolerance);
void kmp_rk_free(kmp_rk *s);

/** Begins at (t, y) towards t_end; h0 = 0 lets it choose the first step (Hairer's hinit). Returns KMP_GO, or what rhs
 *  said. */
int kmp_rk_start(kmp_rk *s, double t, const double *y, double t_end, double h0);

/** One accepted step, not beyond t_end (the last step ends exactly there). KMP_GO; KMP_HALT when the road gave
 *  up; KMP_RETRY when the step has become too small for t (|h| < 16 eps |t|), when more than 100 steps in a row
 *  would each have to be made 1e9 times to reach t_end, or when max_reject consecutive
 *  rejections (1000) were made. */
int kmp_rk_step(kmp_rk *s);

/** The last accepted step went from t_old to t; y and dy there, owned by the integrator. */
double kmp_rk_t(const kmp_rk *s);
double kmp_rk_t_old(const kmp_rk *s);
const double *kmp_rk_y(const kmp_rk *s);
const double *kmp_rk_dy(const kmp_rk *s);

/** y at t_old <= t <= t of the last step. The first call in a step may evaluate rhs (state kept: a
 *  road that remembers its last evaluation must not rely on it being the step's end after this). Returns KMP_GO or
 *  what rhs said. */
int kmp_rk_dense(kmp_rk *s, double t, double *y);

kmp_ode_work kmp_rk_work(const kmp_rk *s);

#endif
