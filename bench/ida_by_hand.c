/* SPDX-License-Identifier: BSD-3-Clause */
/* Andrews' squeezing mechanism as one would write it by hand for IDA: equations of the Test Set for IVP Solvers (Mazzia
 * and Magherini; Hairer and Wanner, Solving ODEs II, VII.7), residual in the AH form, dense matrices, Jacobian by
 * IDA's differences; IDA set as in Kempe's adapter. Beside it Kempe's dae road. Steps at equal error are compared on
 * straight lines through the logarithms; the program fails when Kempe takes more than 1.5 times as many. */
#include "constraints/sundials_compat.h"
#include "judged.h"

#include <ida/ida.h>
#include <sunlinsol/sunlinsol_dense.h>
#include <sunmatrix/sunmatrix_dense.h>

enum { N = 7, M = 6, SIZE = 2 * N + 2 * M };

/* -- the equations ----------------------------------------------------------------------------------- */

static const double m1 = 0.04325, m2 = 0.00365, m3 = 0.02373, m4 = 0.00706, m5 = 0.07050, m6 = 0.00706, m7 = 0.05498;
static const double i1 = 2.194e-6, i2 = 4.410e-7, i3 = 5.255e-6, i4 = 5.667e-7, i5 = 1.169e-5, i6 = 5.667e-7,
                    i7 = 1.912e-5;
static const double xa = -0.06934, ya = -0.00227, xb = -0.03635, yb = 0.03273, xc = 0.014, yc = 0.072, c0 = 4530;
static const double d = 0.028, da = 0.0115, e = 0.02, ea = 0.01421, rr = 0.007, ra = 0.00092, l0 = 0.07785, ss = 0.035;
static const double sa = 0.01874, sb = 0.01043, sc = 0.018, sd = 0.02, ta = 0.02308, tb = 0.00916, u = 0.04;
static const double ua = 0.01228, ub = 0.00449, zf = 0.02, zt = 0.04, fa = 0.01421, mom = 0.033;

/* out = M a: q = beta, theta, gamma, phi, delta, omega, epsilon */
static void mass_times(const double *q, const double *a, double *out)
{
    double c = cos(q[1]), p = sin(q[3]), o = sin(q[5]), ee = e - ea, ff = zf - fa;
    double m21 = m2 * (da * da - da * rr * c) + i2, m54 = m4 * (ee * ee + zt * ee * p) + i4;
    double m76 = m6 * (ff * ff - u * ff * o) + i6;
    out[0] = (m1 * ra * ra + m2 * (rr * rr - 2 * da * rr * c + da * da) + i1 + i2) * a[0] + m21 * a[1];
    out[1] = m21 * a[0] + (m2 * da * da + i2) * a[1];
    out[2] = (m3 * (sa * sa + sb * sb) + i3) * a[2];
    out[3] = (m4 * ee * ee + i4) * a[3] + m54 * a[4];
    out[4] = m54 * a[3] + (m4 * (zt * zt + 2 * zt * ee * p + ee * ee) + m5 * (ta * ta + tb * tb) + i4 + i5) * a[4];
    out[5] = (m6 * ff * ff + i6) * a[5] + m76 * a[6];
    out[6] = m76 * a[5] + (m6 * (ff * ff - 2 * u * ff * o + u * u) + m7 * (ua * ua + ub * ub) + i6 + i7) * a[6];
}

static void forces(const double *q, const double *v, double *f)
{
    double cg = cos(q[2]), sg = sin(q[2]), ee = e - ea, ff = zf - fa;
    double xd = sd * cg + sc * sg + xb, yd = sd * sg - sc * cg + yb, length = hypot(xd - xc, yd - yc);
    double force = -c0 * (length - l0) / length, fx = force * (xd - xc), fy = force * (yd - yc);
    f[0] = mom - m2 * da * rr * v[1] * (v[1] + 2 * v[0]) * sin(q[1]);
    f[1] = m2 * da * rr * v[0] * v[0] * sin(q[1]);
    f[2] = fx * (sc * cg - sd * sg) + fy * (sd * cg + sc * sg);
    f[3] = m4 * zt * ee * v[4] * v[4] * cos(q[3]);
    f[4] = -m4 * zt * ee * v[3] * (v[3] + 2 * v[4]) * cos(q[3]);
    f[5] = -m6 * u * ff * v[6] * v[6] * cos(q[5]);
    f[6] = m6 * u * ff * v[5] * (v[5] + 2 * v[6]) * cos(q[5]);
}

static void closure(const double *q, double *g)
{
    double x = rr * cos(q[0]) - d * cos(q[0] + q[1]), y = rr * sin(q[0]) - d * sin(q[0] + q[1]);
    g[0] = x - ss * sin(q[2]) - xb;
    g[1] = y + ss * cos(q[2]) - yb;
    g[2] = x - e * sin(q[3] + q[4]) - zt * cos(q[4]) - xa;
    g[3] = y + e * cos(q[3] + q[4]) - zt * sin(q[4]) - ya;
    g[4] = x - zf * cos(q[5] + q[6]) - u * sin(q[6]) - xa;
    g[5] = y - zf * sin(q[5] + q[6]) + u * cos(q[6]) - ya;
}

static void closure_jacobian(const double *q, double j[M][N])
{
    double s1 = d * sin(q[0] + q[1]), c1 = d * cos(q[0] + q[1]);
    memset(j, 0, M * sizeof *j);
    for (int r = 0; r < M; r += 2) {
        j[r][0] = -rr * sin(q[0]) + s1;
        j[r][1] = s1;
        j[r + 1][0] = rr * cos(q[0]) - c1;
        j[r + 1][1] = -c1;
    }
    j[0][2] = -ss * cos(q[2]);
    j[1][2] = -ss * sin(q[2]);
    j[2][3] = -e * cos(q[3] + q[4]);
    j[2][4] = j[2][3] + zt * sin(q[4]);
    j[3][3] = -e * sin(q[3] + q[4]);
    j[3][4] = j[3][3] - zt * cos(q[4]);
    j[4][5] = zf * sin(q[5] + q[6]);
    j[4][6] = j[4][5] - u * cos(q[6]);
    j[5][5] = -zf * cos(q[5] + q[6]);
    j[5][6] = j[5][5] - u * sin(q[6]);
}

/* q' - v + G' mu, M v' - f + G' lambda, g, G v with lambda and mu as derivatives. */
static int residual(sunrealtype t, N_Vector y, N_Vector yp, N_Vector r, void *user)
{
    const double *q = kmp_sun_data(y), *v = q + N, *qp = kmp_sun_data(yp), *vp = qp + N, *lambda = qp + 2 * N;
    const double *mu = lambda + M;
    double *out = kmp_sun_data(r), f[N], j[M][N];
    (void)t, (void)user;
    mass_times(q, vp, out + N);
    forces(q, v, f);
    closure(q, out + 2 * N);
    closure_jacobian(q, j);
    for (int i = 0; i < N; i++) {
        out[i] = qp[i] - v[i];
        out[N + i] -= f[i];
        for (int k = 0; k < M; k++) {
            out[i] += j[k][i] * mu[k];
            out[N + i] += j[k][i] * lambda[k];
        }
    }
    for (int k = 0; k < M; k++) {
        out[2 * N + M + k] = 0;
        for (int i = 0; i < N; i++)
            out[2 * N + M + k] += j[k][i] * v[i];
    }
    return 0;
}

/* -- IDA --------------------------------------------------------------------------------------------- */

static const double start_q[N] = {-0.0617138900142764496358948458001, 0,
                                  0.455279819163070380255912382449,   0.222668390165885884674473185609,
                                  0.487364979543842550225598953530,   -0.222668390165885884674473185609,
                                  1.23054744454982119249735015568};
static const double start_qdd[2] = {14222.4439199541138705911625887, -10666.8329399655854029433719415};
static const double start_lambda[2] = {98.5668703962410896057654982170, -6.12268834425566265503114393122};

/* At 0.03 s, recomputed in quadruple precision: the published digits are good to ten. */
static const double end_q[N] = {15.81077119515370709711, -15.75637105841183946971, 0.04082224011964580485815,
                                -0.53473011634207959377, 0.52440996587995406937,   0.53473011634207959377,
                                1.04808074104193787307};

static double error_of(const double *q)
{
    double worst = 0;
    for (int i = 0; i < N; i++)
        worst = fmax(worst, fabs(q[i] - end_q[i]) / fmax(fabs(end_q[i]), 1));
    return worst;
}

typedef struct hand {
    double rtol, rate_scale;
    long steps;
} hand;

static int weights(N_Vector y, N_Vector w, void *user)
{
    const hand *h = user;
    for (int i = 0; i < SIZE; i++) {
        double atol = i >= N && i < 2 * N ? h->rtol * h->rate_scale : h->rtol;
        kmp_sun_data(w)[i] = 1 / ((h->rtol * fabs(kmp_sun_data(y)[i]) + atol) * (i < 2 * N ? 1 : 1e14));
    }
    return 0;
}

static void check(bool good, const char *what)
{
    if (good)
        return;
    fprintf(stderr, "%s\n", what);
    exit(1);
}

static bool integrate(hand *h, double *q)
{
    SUNContext sun = kmp_sun_context();
    N_Vector y = N_VNew_Serial(SIZE, sun), yp = N_VNew_Serial(SIZE, sun);
    SUNMatrix a = SUNDenseMatrix(SIZE, SIZE, sun);
    SUNLinearSolver linear = SUNLinSol_Dense(y, a, sun);
    void *ida = IDACreate(sun);
    double t = 0;
    N_VConst(0, y);
    N_VConst(0, yp);
    memcpy(kmp_sun_data(y), start_q, sizeof start_q);
    memcpy(kmp_sun_data(yp) + N, start_qdd, sizeof start_qdd);
    memcpy(kmp_sun_data(yp) + 2 * N, start_lambda, sizeof start_lambda);
    KMP_SUN_QUIET(IDASetErrHandlerFn, ida);
    check(!IDAInit(ida, residual, 0, y, yp) && !IDASetUserData(ida, h) && !IDAWFtolerances(ida, weights) &&
              !IDASetLinearSolver(ida, linear, a) && !IDASetNonlinConvCoef(ida, 0.01) &&
              !IDASetInitStep(ida, 0.1 * sqrt(h->rtol) / h->rate_scale) && !IDASetStopTime(ida, 0.03) &&
              !IDASetMaxNumSteps(ida, -1),
          "IDA refused its settings");
    int flag = IDASolve(ida, 0.03, &t, y, yp, IDA_NORMAL);
    (void)IDAGetNumSteps(ida, &h->steps);
    memcpy(q, kmp_sun_data(y), N * sizeof *q);
    IDAFree(&ida);
    SUNLinSolFree(linear);
    SUNMatDestroy(a);
    N_VDestroy(y);
    N_VDestroy(yp);
    SUNContext_Free(&sun);
    return flag >= 0;
}

/* -- side by side ------------------------------------------------------------------------------------ */

enum { TOLERANCES = 10 };

/* log10 of the steps at an error, on the line of least squares through log steps over log error. */
static double steps_at(const double *error, const double *steps, int count, double at)
{
    double x = 0, y = 0, xx = 0, xy = 0;
    for (int k = 0; k < count; k++) {
        x += error[k];
        y += steps[k];
        xx += error[k] * error[k];
        xy += error[k] * steps[k];
    }
    double slope = (count * xy - x * y) / (count * xx - x * x);
    return y / count + slope * (at - x / count);
}

int main(void)
{
    static const char *const forms[] = {"ah", "ggl", "index2", "index1"};
    double error[5][TOLERANCES], steps[5][TOLERANCES], end = 0.03, worst = 0;
    bench b = bench_load("examples/andrews/andrews.yaml");
    kempe_assembly *start = NULL;
    kmp_reference reference;
    check(!kempe_assemble(b.system, &start) &&
              !kmp_reference_read(b.system, "examples/andrews/reference.csv", &reference),
          kempe_context_message(b.context));
    judged j = {.b = &b, .reference = &reference};
    printf("steps [error q at 0.03 s]\n%-7s | %-17s", "rtol", "by hand, AH");
    for (int f = 0; f < 4; f++)
        printf(" | Kempe %-11s", forms[f]);
    for (int k = 0; k < TOLERANCES; k++) {
        double rtol = pow(10, -4 - k), q[N];
        hand h = {.rtol = rtol, .rate_scale = sqrt(start_qdd[0])};
        check(integrate(&h, q), "the model by hand failed");
        error[0][k] = log10(error_of(q));
        steps[0][k] = log10((double)h.steps);
        printf("\n%-7.0e | %6ld [%8.1e]", rtol, h.steps, pow(10, error[0][k]));
        for (int f = 0; f < 4; f++) {
            kmp_run_spec spec = {
                .road = "dae", .form = forms[f], .rtol = rtol, .t_end = end, .time_count = 1, .times = &end};
            check(judged_run(&j, &spec, start, 1), "Kempe's run failed");
            error[f + 1][k] = log10(j.q);
            steps[f + 1][k] = log10((double)j.report.steps);
            printf(" | %6ld [%8.1e]", j.report.steps, j.q);
        }
    }
    printf("\n\nKempe's steps by those of the model by hand at equal error\n");
    for (int at = -4; at >= -10; at -= 2) {
        printf("%-7.0e | %17s", pow(10, at), "1");
        for (int f = 1; f <= 4; f++) {
            double ratio =
                pow(10, steps_at(error[f], steps[f], TOLERANCES, at) - steps_at(error[0], steps[0], TOLERANCES, at));
            worst = fmax(worst, ratio);
            printf(" | %17.2f", ratio);
        }
        printf("\n");
    }
    printf("at most %.2f: %s 1.5\n", worst, worst <= 1.5 ? "within" : "NOT within");
    kmp_reference_free(&reference);
    kempe_assembly_free(start);
    bench_free(&b);
    return worst <= 1.5 ? 0 : 1;
}
