/* SPDX-License-Identifier: BSD-3-Clause */
/* DOPRI5: Dormand and Prince's pair of orders 5 and 4 with dense output of order 4 (explicit_methods.h). Cheaper than
 * DOP853 at rtol of 1e-5 and above. */
#include "integrators/steppers/dopri5.h"
#include "integrators/steppers/rk.h"

static int run(kmp_rk *s, double h, double t_new)
{
    int n = s->base.ode.n;
    double t = s->base.t, *y = s->y, **k = s->k;
    const double *const C = kmp_dopri5_c;
    KMP_DOPRI5_STAGES(KMP_STAGE, k);
    kmp_dopri5_solution(n, y, h, k, s->y_old);
    return kmp_solver_call(&s->base, t_new, s->y_old, k[7]);
}

static double error_of(kmp_rk *s, double h)
{
    return kmp_dopri5_error(s->base.ode.n, h, s->k, s->y, s->y_old, s->base.tolerance.atol, s->base.tolerance.rtol,
                            s->w);
}

static int prepare_dense(kmp_rk *s)
{
    kmp_rk_begin_dense(s);
    for (int i = 0; i < s->base.ode.n; i++)
        s->interpolant[4][i] = kmp_dopri5_dense(s->taken, s->k, i);
    return KMP_GO;
}

const kmp_rk_method kmp_dopri5 = {.numbers = KMP_DOPRI5_NUMBERS,
                                  .ends_with_derivative = true,
                                  .run = run,
                                  .error = error_of,
                                  .prepare_dense = prepare_dense};

KMP_RK_SOLVER(dopri5, false);
