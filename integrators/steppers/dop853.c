/* SPDX-License-Identifier: BSD-3-Clause */
/* DOP853: order 8, combined error estimate of orders 5 and 3, dense output of order 7 (explicit_methods.h). */
#include "integrators/steppers/dop853.h"
#include "integrators/steppers/rk.h"

/* -- stages ---------------------------------------------------------------------------------------- */

static int run(kmp_rk *s, double h, double t_new)
{
    int n = s->base.ode.n;
    double t = s->base.t, *y = s->y, **k = s->k;
    const double *const C = kmp_dop853_c;
    (void)t_new;
    KMP_DOP853_STAGES(KMP_STAGE, k);
    return KMP_GO;
}

static double solution_and_error(kmp_rk *s, double h)
{
    double error;
    const kmp_dop853_step step = {s->y, &h,    s->base.tolerance.atol, s->k, s->base.tolerance.rtol, s->y_old,
                                  s->w, &error};
    kmp_dop853_solution(1, false, (size_t)s->base.ode.n, &step);
    return error;
}

/* -- dense output ---------------------------------------------------------------------------------- */

/* II.6: the values and slopes at both ends, and four more coefficients. */
static int prepare_dense(kmp_rk *s)
{
    int n = s->base.ode.n;
    double t = s->base.t_old, h = s->taken, *y = s->y_old, **k = s->k;
    const double *const C = kmp_dop853_c;
    KMP_DOP853_DENSE_STAGES(KMP_STAGE, k);
    kmp_rk_begin_dense(s);
    kmp_dop853_dense_all(n, 0, 1, h, k, s->interpolant);
    return KMP_GO;
}

const kmp_rk_method kmp_dop853 = {
    .numbers = KMP_DOP853_NUMBERS, .run = run, .error = solution_and_error, .prepare_dense = prepare_dense};

KMP_RK_SOLVER(dop853, true);
