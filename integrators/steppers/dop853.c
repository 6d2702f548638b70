/* SPDX-License-Identifier: BSD-3-Clause */
/* DOP853: order 8, combined error estimate of orders 5 and 3, dense output of order 7. Coefficients and estimators
 * after Hairer, Norsett, Wanner, Solving Ordinary Differential Equations I, 2nd ed., II.5 (method), II.6 (dense
 * output), II.10 (error), and the authors' published code. */
#include "integrators/steppers/dop853.h"

/* Stages 1, 6 .. 16 in the last four coefficients of the dense output's interpolant. */
enum { STAGES = 16, DENSE_TERMS = 12 };
static const double D[4][DENSE_TERMS] = {
    {-0.84289382761090128651353491142e+1, 0.56671495351937776962531783590, -0.30689499459498916912797304727e+1,
     0.23846676565120698287728149680e+1, 0.21170345824450282767155149946e+1, -0.87139158377797299206789907490,
     0.22404374302607882758541771650e+1, 0.63157877876946881815570249290, -0.88990336451333310820698117400e-1,
     0.18148505520854727256656404962e+2, -0.91946323924783554000451984436e+1, -0.44360363875948939664310572000e+1},
    {0.10427508642579134603413151009e+2, 0.24228349177525818288430175319e+3, 0.16520045171727028198505394887e+3,
     -0.37454675472269020279518312152e+3, -0.22113666853125306036270938578e+2, 0.77334326684722638389603898808e+1,
     -0.30674084731089398182061213626e+2, -0.93321305264302278729567221706e+1, 0.15697238121770843886131091075e+2,
     -0.31139403219565177677282850411e+2, -0.93529243588444783865713862664e+1, 0.35816841486394083752465898540e+2},
    {0.19985053242002433820987653617e+2, -0.38703730874935176555105901742e+3, -0.18917813819516756882830838328e+3,
     0.52780815920542364900561016686e+3, -0.11573902539959630126141871134e+2, 0.68812326946963000169666922661e+1,
     -0.10006050966910838403183860980e+1, 0.77771377980534432092869265740, -0.27782057523535084065932004339e+1,
     -0.60196695231264120758267380846e+2, 0.84320405506677161018159903784e+2, 0.11992291136182789328035130030e+2},
    {-0.25693933462703749003312586129e+2, -0.15418974869023643374053993627e+3, -0.23152937917604549567536039109e+3,
     0.35763911791061412378285349910e+3, 0.93405324183624310003907691704e+2, -0.37458323136451633156875139351e+2,
     0.10409964950896230045147246184e+3, 0.29840293426660503123344363579e+2, -0.43533456590011143754432175058e+2,
     0.96324553959188282948394950600e+2, -0.39177261675615439165231486172e+2, -0.14972683625798562581422125276e+3}};

/* -- stages ---------------------------------------------------------------------------------------- */

static int run(kmp_rk *s, double h, double t_new)
{
    int n = s->base.ode.n;
    double t = s->base.t, *y = s->y, **k = s->k;
    (void)t_new;
    KMP_DOP853_STAGES(KMP_STAGE, k);
    return KMP_GO;
}

static double solution_and_error(kmp_rk *s, double h)
{
    double error;
    const kmp_dop853_step step = {s->y, &h,    s->base.tolerance.atol, s->k, s->base.tolerance.rtol, s->y_old,
                                  s->w, &error};
    kmp_dop853_solution(1, (size_t)s->base.ode.n, &step);
    return error;
}

/* -- dense output ---------------------------------------------------------------------------------- */

static int extra_stages(kmp_rk *s)
{
    int n = s->base.ode.n;
    double t = s->base.t_old, h = s->taken, *y = s->y_old, **k = s->k;
    KMP_STAGE(14, A14, k[1], k[7], k[8], k[9], k[10], k[11], k[12], k[13]);
    KMP_STAGE(15, A15, k[1], k[6], k[7], k[8], k[11], k[12], k[13], k[14]);
    KMP_STAGE(16, A16, k[1], k[6], k[7], k[8], k[9], k[13], k[14], k[15]);
    return KMP_GO;
}

/* II.6: the values and slopes at both ends, and four more coefficients. */
static int prepare_dense(kmp_rk *s)
{
    int n = s->base.ode.n, said = extra_stages(s);
    if (said != KMP_GO)
        return said;
    double h = s->taken, **r = s->interpolant, **k = s->k;
    kmp_rk_begin_dense(s);
    for (int i = 0; i < n; i++)
        for (int j = 0; j < 4; j++) {
            double sum = D[j][0] * k[1][i];
            for (int l = 1; l < DENSE_TERMS; l++)
                sum += D[j][l] * k[l + 5][i];
            r[4 + j][i] = h * sum;
        }
    return KMP_GO;
}

const kmp_rk_method kmp_dop853 = {.stages = STAGES,
                                  .end = 13,
                                  .interpolants = 8,
                                  .order = 8,
                                  .exponent = 1.0 / 8.0 - 0.2 * KMP_RK_BETA,
                                  .shrink = 3.0,
                                  .grow = 6.0,
                                  .run = run,
                                  .error = solution_and_error,
                                  .prepare_dense = prepare_dense};

KMP_RK_SOLVER(dop853, true);
