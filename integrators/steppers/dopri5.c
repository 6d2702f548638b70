/* SPDX-License-Identifier: BSD-3-Clause */
/* DOPRI5: Dormand and Prince's pair of orders 5 and 4 with dense output of order 4. Coefficients after Hairer, Norsett,
 * Wanner, Solving Ordinary Differential Equations I, 2nd ed., II.5 (table 5.2), II.6, and the authors' published code.
 * Cheaper than DOP853 at rtol of 1e-5 and above. */
#include "integrators/steppers/rk.h"

#include <math.h>

/* -- the method: row i holds the nonzero coefficients of stage i ------------------------------------ */

enum { STAGES = 7 };

static const double C[STAGES] = {0, 0, 1.0 / 5, 3.0 / 10, 4.0 / 5, 8.0 / 9, 1};
static const double A2[] = {1.0 / 5};
static const double A3[] = {3.0 / 40, 9.0 / 40};
static const double A4[] = {44.0 / 45, -56.0 / 15, 32.0 / 9};
static const double A5[] = {19372.0 / 6561, -25360.0 / 2187, 64448.0 / 6561, -212.0 / 729};
static const double A6[] = {9017.0 / 3168, -355.0 / 33, 46732.0 / 5247, 49.0 / 176, -5103.0 / 18656};

/* Stages 1, 3 .. 6 of the solution; 1, 3 .. 7 of its error and of the dense output's last coefficient. */
static const double B[] = {35.0 / 384, 500.0 / 1113, 125.0 / 192, -2187.0 / 6784, 11.0 / 84};
static const double E[] = {71.0 / 57600, -71.0 / 16695, 71.0 / 1920, -17253.0 / 339200, 22.0 / 525, -1.0 / 40};
static const double D[] = {-12715105075.0 / 11282082432,  87487479700.0 / 32700410799, -10690763975.0 / 1880347072,
                           701980252875.0 / 199316789632, -1453857185.0 / 822651844,   69997945.0 / 29380423};

static int run(kmp_rk *s, double h, double t_new)
{
    int n = s->base.ode.n;
    double t = s->base.t, *y = s->y, **k = s->k;
    KMP_STAGE(2, A2, k[1]);
    KMP_STAGE(3, A3, k[1], k[2]);
    KMP_STAGE(4, A4, k[1], k[2], k[3]);
    KMP_STAGE(5, A5, k[1], k[2], k[3], k[4]);
    KMP_STAGE(6, A6, k[1], k[2], k[3], k[4], k[5]);
    kmp_rk_combine(n, y, h, KMP_TERMS(B), B, (const double *const[]){k[1], k[3], k[4], k[5], k[6]}, s->y_old);
    return kmp_solver_call(&s->base, t_new, s->y_old, k[7]);
}

/* sum over stages 1, 3 .. 7 */
KMP_INLINE double six(const double *a, double *const *k, int i)
{
    return a[0] * k[1][i] + a[1] * k[3][i] + a[2] * k[4][i] + a[3] * k[5][i] + a[4] * k[6][i] + a[5] * k[7][i];
}

static double error_of(kmp_rk *s, double h)
{
    int n = s->base.ode.n;
    double sum = 0, rtol = s->base.tolerance.rtol;
    for (int i = 0; i < n; i++) {
        s->w[i] = s->base.tolerance.atol[i] + rtol * fmax(fabs(s->y[i]), fabs(s->y_old[i]));
        double e = h * six(E, s->k, i) / s->w[i];
        sum += e * e;
    }
    return sum == 0 ? 0 : sqrt(sum / n);
}

static int prepare_dense(kmp_rk *s)
{
    kmp_rk_begin_dense(s);
    for (int i = 0; i < s->base.ode.n; i++)
        s->interpolant[4][i] = s->taken * six(D, s->k, i);
    return KMP_GO;
}

const kmp_rk_method kmp_dopri5 = {.stages = STAGES,
                                  .end = 7,
                                  .ends_with_derivative = true,
                                  .interpolants = 5,
                                  .order = 5,
                                  .exponent = 1.0 / 5.0 - 0.75 * KMP_RK_BETA,
                                  .shrink = 5.0,
                                  .grow = 10.0,
                                  .run = run,
                                  .error = error_of,
                                  .prepare_dense = prepare_dense};

KMP_RK_SOLVER(dopri5, false);
