/* SPDX-License-Identifier: BSD-3-Clause */
/* Explicit Runge-Kutta methods as numbers and sums, for the library's driver (rk.h), for lanes and for generated
 * simulators: coefficients, stages, error estimates and dense output of DOP853 and DOPRI5. C99, no library but
 * libm. Coefficients and estimators after Hairer, Norsett, Wanner, Solving Ordinary Differential Equations
 * I, 2nd ed., II.5 (methods), II.6 (dense output), II.10 (error of DOP853), and the authors' published codes. */
#pragma once

#include "integrators/decide/step_control.h"
#include <float.h>
#include <math.h>
#include <stdbool.h>
#include <stddef.h>

enum { KMP_RK_MAX_STAGES = 16, KMP_RK_MAX_INTERPOLANTS = 8 };

/* -- dense output ------------------------------------------------------------------------------------ */

/* The largest term of highest order of an interpolant that is taken, in tolerances. It is 5 to 200 where the solution
 * is resolved. A method at the bound of its stability damps fast motions at the ends of steps but not between them: the
 * term was 9e4 where the interpolant was wrong by 1e4 tolerances, the step by one. */
#define KMP_RK_COARSE 3e2

/* The first four vectors of the interpolant of a component: a cubic by the values and slopes at both ends. */
KMP_INLINE void kmp_rk_cubic(double h, double y_old, double y, double begin, double end, double r[4])
{
    double rise = y - y_old, curvature = h * begin - rise;
    r[0] = y_old;
    r[1] = rise;
    r[2] = curvature;
    r[3] = rise - h * end - curvature;
}

/* The same of n components, which are `stride` apart, from numbers of the step on. */
KMP_INLINE void kmp_rk_cubics(int n, size_t stride, double h, const double *y_old, const double *y, const double *begin,
                              const double *end, double *const *r)
{
    for (size_t i = 0, at = 0; i < (size_t)n; i++, at += stride) {
        double cubic[4];
        kmp_rk_cubic(h, y_old[at], y[at], begin[at], end[at], cubic);
        for (int j = 0; j < 4; j++)
            r[j][i] = cubic[j];
    }
}

/* The value at x, 0 to 1, of vectors r of n components: r0 + x (r1 + z (r2 + x (r3 + ...))), z = 1 - x. */
KMP_INLINE void kmp_rk_interpolate(int n, int vectors, double *const *r, double x, double *y)
{
    for (int i = 0; i < n; i++)
        y[i] = r[vectors - 1][i];
    for (int j = vectors - 1; j-- > 0;) {
        double factor = j % 2 ? 1.0 - x : x;
        for (int i = 0; i < n; i++)
            y[i] = r[j][i] + factor * y[i];
    }
}

/* True for an interpolant that is less exact than its step: the largest term of highest order, in tolerances w, of the
 * last of `vectors`. Components are `stride` and `stride_w` apart. */
KMP_INLINE bool kmp_rk_is_coarse(int n, int vectors, const double *last, size_t stride, const double *w,
                                 size_t stride_w)
{
    double most = 0;
    for (size_t i = 0; i < (size_t)n; i++)
        most = fmax(most, fabs(last[i * stride]) / w[i * stride_w]);
    return !(ldexp(most, 1 - vectors) <= KMP_RK_COARSE);
}

/* -- stages ------------------------------------------------------------------------------------------ */

/* out = y + h sum a[j] k[j]; unrolled over the terms, whose number is constant at each call. */
KMP_INLINE void kmp_rk_combine(int n, const double *y, double h, int terms, const double *a, const double *const *k,
                               double *restrict out)
{
    for (int i = 0; i < n; i++) {
        double sum = a[0] * k[0][i];
        for (int j = 1; j < terms; j++)
            sum += a[j] * k[j][i];
        out[i] = y[i] + h * sum;
    }
}

#define KMP_TERMS(a) ((int)(sizeof(a) / sizeof *(a)))

/* -- DOPRI5 ------------------------------------------------------------------------------------------- */

#define KMP_DOPRI5_NUMBERS                                                                                             \
    {                                                                                                                  \
        .stages = 7, .end = 7, .interpolants = 5, .order = 5, .exponent = 1.0 / 5.0 - 0.75 * KMP_RK_BETA,              \
        .shrink = 5.0, .grow = 10.0                                                                                    \
    }

/* Row i of the coefficients holds the nonzero ones of stage i. */
static const double kmp_dopri5_c[7] = {0, 0, 1.0 / 5, 3.0 / 10, 4.0 / 5, 8.0 / 9, 1};
static const double kmp_dopri5_a2[] = {1.0 / 5};
static const double kmp_dopri5_a3[] = {3.0 / 40, 9.0 / 40};
static const double kmp_dopri5_a4[] = {44.0 / 45, -56.0 / 15, 32.0 / 9};
static const double kmp_dopri5_a5[] = {19372.0 / 6561, -25360.0 / 2187, 64448.0 / 6561, -212.0 / 729};
static const double kmp_dopri5_a6[] = {9017.0 / 3168, -355.0 / 33, 46732.0 / 5247, 49.0 / 176, -5103.0 / 18656};

/* Stages 1, 3 .. 6 of the solution; 1, 3 .. 7 of its error and of the dense output's last coefficient. */
static const double kmp_dopri5_b[] = {35.0 / 384, 500.0 / 1113, 125.0 / 192, -2187.0 / 6784, 11.0 / 84};
static const double kmp_dopri5_e[] = {71.0 / 57600,      -71.0 / 16695, 71.0 / 1920,
                                      -17253.0 / 339200, 22.0 / 525,    -1.0 / 40};
static const double kmp_dopri5_d[] = {-12715105075.0 / 11282082432, 87487479700.0 / 32700410799,
                                      -10690763975.0 / 1880347072,  701980252875.0 / 199316789632,
                                      -1453857185.0 / 822651844,    69997945.0 / 29380423};

/* Stages 2 to 6. */
#define KMP_DOPRI5_STAGES(STAGE, k)                                                                                    \
    STAGE(2, kmp_dopri5_a2, k[1]);                                                                                     \
    STAGE(3, kmp_dopri5_a3, k[1], k[2]);                                                                               \
    STAGE(4, kmp_dopri5_a4, k[1], k[2], k[3]);                                                                         \
    STAGE(5, kmp_dopri5_a5, k[1], k[2], k[3], k[4]);                                                                   \
    STAGE(6, kmp_dopri5_a6, k[1], k[2], k[3], k[4], k[5])

KMP_INLINE void kmp_dopri5_solution(int n, const double *y, double h, double *const *k, double *y_new)
{
    kmp_rk_combine(n, y, h, KMP_TERMS(kmp_dopri5_b), kmp_dopri5_b,
                   (const double *const[]){k[1], k[3], k[4], k[5], k[6]}, y_new);
}

/* sum over stages 1, 3 .. 7 */
KMP_INLINE double kmp_dopri5_six(const double *a, double *const *k, int i)
{
    return a[0] * k[1][i] + a[1] * k[3][i] + a[2] * k[4][i] + a[3] * k[5][i] + a[4] * k[6][i] + a[5] * k[7][i];
}

/* The weights, and the error estimate: 1 is at the tolerance. */
KMP_INLINE double kmp_dopri5_error(int n, double h, double *const *k, const double *y, const double *y_new,
                                   const double *atol, double rtol, double *weight)
{
    double sum = 0;
    for (int i = 0; i < n; i++) {
        weight[i] = atol[i] + rtol * fmax(fabs(y[i]), fabs(y_new[i]));
        double e = h * kmp_dopri5_six(kmp_dopri5_e, k, i) / weight[i];
        sum += e * e;
    }
    return sum == 0 ? 0 : sqrt(sum / n);
}

/* The last coefficient of the dense output of component i. */
KMP_INLINE double kmp_dopri5_dense(double h, double *const *k, int i)
{
    return h * kmp_dopri5_six(kmp_dopri5_d, k, i);
}

/* -- DOP853 ------------------------------------------------------------------------------------------- */

#define KMP_DOP853_NUMBERS                                                                                             \
    {                                                                                                                  \
        .stages = 16, .end = 13, .interpolants = 8, .order = 8, .exponent = 1.0 / 8.0 - 0.2 * KMP_RK_BETA,             \
        .shrink = 3.0, .grow = 6.0                                                                                     \
    }

/* Row i of the coefficients holds the nonzero ones of stage i, in the order of the stages used. */
static const double kmp_dop853_c[17] = {0.0,
                                        0.0,
                                        0.0526001519587677318785587544488,
                                        0.0789002279381515978178381316732,
                                        0.118350341907227396726757197510,
                                        0.281649658092772603273242802490,
                                        0.333333333333333333333333333333,
                                        0.25,
                                        0.307692307692307692307692307692,
                                        0.651282051282051282051282051282,
                                        0.6,
                                        0.857142857142857142857142857142,
                                        1.0,
                                        1.0,
                                        0.1,
                                        0.2,
                                        0.777777777777777777777777777778};

static const double kmp_dop853_a2[] = {5.26001519587677318785587544488e-2};
static const double kmp_dop853_a3[] = {1.97250569845378994544595329183e-2, 5.91751709536136983633785987549e-2};
static const double kmp_dop853_a4[] = {2.95875854768068491816892993775e-2, 8.87627564304205475450678981324e-2};
static const double kmp_dop853_a5[] = {2.41365134159266685502369798665e-1, -8.84549479328286085344864962717e-1,
                                       9.24834003261792003115737966543e-1};
static const double kmp_dop853_a6[] = {3.7037037037037037037037037037e-2, 1.70828608729473871279604482173e-1,
                                       1.25467687566822425016691814123e-1};
static const double kmp_dop853_a7[] = {3.7109375e-2, 1.70252211019544039314978060272e-1,
                                       6.02165389804559606850219397283e-2, -1.7578125e-2};
static const double kmp_dop853_a8[] = {3.70920001185047927108779319836e-2, 1.70383925712239993810214054705e-1,
                                       1.07262030446373284651809199168e-1, -1.53194377486244017527936158236e-2,
                                       8.27378916381402288758473766002e-3};
static const double kmp_dop853_a9[] = {6.24110958716075717114429577812e-1,  -3.36089262944694129406857109825,
                                       -8.68219346841726006818189891453e-1, 2.75920996994467083049415600797e1,
                                       2.01540675504778934086186788979e1,   -4.34898841810699588477366255144e1};
static const double kmp_dop853_a10[] = {4.77662536438264365890433908527e-1,  -2.48811461997166764192642586468,
                                        -5.90290826836842996371446475743e-1, 2.12300514481811942347288949897e1,
                                        1.52792336328824235832596922938e1,   -3.32882109689848629194453265587e1,
                                        -2.03312017085086261358222928593e-2};
static const double kmp_dop853_a11[] = {-9.3714243008598732571704021658e-1, 5.18637242884406370830023853209,
                                        1.09143734899672957818500254654,    -8.14978701074692612513997267357,
                                        -1.85200656599969598641566180701e1, 2.27394870993505042818970056734e1,
                                        2.49360555267965238987089396762,    -3.0467644718982195003823669022};
static const double kmp_dop853_a12[] = {
    2.27331014751653820792359768449,    -1.05344954667372501984066689879e1, -2.00087205822486249909675718444,
    -1.79589318631187989172765950534e1, 2.79488845294199600508499808837e1,  -2.85899827713502369474065508674,
    -8.87285693353062954433549289258,   1.23605671757943030647266201528e1,  6.43392746015763530355970484046e-1};
static const double kmp_dop853_a14[] = {5.61675022830479523392909219681e-2,  2.53500210216624811088794765333e-1,
                                        -2.46239037470802489917441475441e-1, -1.24191423263816360469010140626e-1,
                                        1.5329179827876569731206322685e-1,   8.20105229563468988491666602057e-3,
                                        7.56789766054569976138603589584e-3,  -8.298e-3};
static const double kmp_dop853_a15[] = {3.18346481635021405060768473261e-2,  2.83009096723667755288322961402e-2,
                                        5.35419883074385676223797384372e-2,  -5.49237485713909884646569340306e-2,
                                        -1.08347328697249322858509316994e-4, 3.82571090835658412954920192323e-4,
                                        -3.40465008687404560802977114492e-4, 1.41312443674632500278074618366e-1};
static const double kmp_dop853_a16[] = {-4.28896301583791923408573538692e-1, -4.69762141536116384314449447206,
                                        7.68342119606259904184240953878,     4.06898981839711007970213554331,
                                        3.56727187455281109270669543021e-1,  -1.39902416515901462129418009734e-3,
                                        2.9475147891527723389556272149,      -9.15095847217987001081870187138};

/* Stages 1, 6 .. 12 of the 8th-order solution and of the 5th-order error; stages 1, 9, 12 of the 3rd-order one. */
static const double kmp_dop853_b[] = {5.42937341165687622380535766363e-2, 4.45031289275240888144113950566,
                                      1.89151789931450038304281599044,    -5.8012039600105847814672114227,
                                      3.1116436695781989440891606237e-1,  -1.52160949662516078556178806805e-1,
                                      2.01365400804030348374776537501e-1, 4.47106157277725905176885569043e-2};
static const double kmp_dop853_e5[] = {0.1312004499419488073250102996e-1, -0.1225156446376204440720569753e1,
                                       -0.4957589496572501915214079952,   0.1664377182454986536961530415e1,
                                       -0.3503288487499736816886487290,   0.3341791187130174790297318841,
                                       0.8192320648511571246570742613e-1, -0.2235530786388629525884427845e-1};
static const double kmp_dop853_b3[] = {0.244094488188976377952755905512, 0.733846688281611857341361741547,
                                       0.0220588235294117647058823529412};

/* Stages 2 to 12: STAGE(number, coefficients, stages of the coefficients). */
#define KMP_DOP853_STAGES(STAGE, k)                                                                                    \
    STAGE(2, kmp_dop853_a2, k[1]);                                                                                     \
    STAGE(3, kmp_dop853_a3, k[1], k[2]);                                                                               \
    STAGE(4, kmp_dop853_a4, k[1], k[3]);                                                                               \
    STAGE(5, kmp_dop853_a5, k[1], k[3], k[4]);                                                                         \
    STAGE(6, kmp_dop853_a6, k[1], k[4], k[5]);                                                                         \
    STAGE(7, kmp_dop853_a7, k[1], k[4], k[5], k[6]);                                                                   \
    STAGE(8, kmp_dop853_a8, k[1], k[4], k[5], k[6], k[7]);                                                             \
    STAGE(9, kmp_dop853_a9, k[1], k[4], k[5], k[6], k[7], k[8]);                                                       \
    STAGE(10, kmp_dop853_a10, k[1], k[4], k[5], k[6], k[7], k[8], k[9]);                                               \
    STAGE(11, kmp_dop853_a11, k[1], k[4], k[5], k[6], k[7], k[8], k[9], k[10]);                                        \
    STAGE(12, kmp_dop853_a12, k[1], k[4], k[5], k[6], k[7], k[8], k[9], k[10], k[11])

/* Further stages, 14 to 16, for dense output. */
#define KMP_DOP853_DENSE_STAGES(STAGE, k)                                                                              \
    STAGE(14, kmp_dop853_a14, k[1], k[7], k[8], k[9], k[10], k[11], k[12], k[13]);                                     \
    STAGE(15, kmp_dop853_a15, k[1], k[6], k[7], k[8], k[11], k[12], k[13], k[14]);                                     \
    STAGE(16, kmp_dop853_a16, k[1], k[6], k[7], k[8], k[9], k[13], k[14], k[15])

/* Stages 1, 6 .. 16 in the last four coefficients of the dense output's interpolant. */
enum { KMP_DOP853_DENSE_TERMS = 12 };
static const double kmp_dop853_d[4][KMP_DOP853_DENSE_TERMS] = {
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

/* Number j of the last four coefficients of the dense output (II.6) of the component at i. */
KMP_INLINE double kmp_dop853_dense(double h, double *const *k, size_t i, int j)
{
    double sum = kmp_dop853_d[j][0] * k[1][i];
    for (int l = 1; l < KMP_DOP853_DENSE_TERMS; l++)
        sum += kmp_dop853_d[j][l] * k[l + 5][i];
    return h * sum;
}

/* The same of n components, which are `stride` apart, the first at `first`. */
KMP_INLINE void kmp_dop853_dense_all(int n, size_t first, size_t stride, double h, double *const *k, double *const *r)
{
    for (size_t i = 0, at = first; i < (size_t)n; i++, at += stride)
        for (int j = 0; j < 4; j++)
            r[4 + j][i] = kmp_dop853_dense(h, k, at, j);
}

/** Inputs and outputs of an error estimate, with w numbers per component, one for each lane. */
typedef struct kmp_dop853_step {
    const double *y, *h, *atol; /* h: one per lane */
    double *const *k;           /* k[1] .. k[12] */
    double rtol;
    double *y_new, *weight, *error; /* error: one per lane */
} kmp_dop853_step;

enum { KMP_DOP853_WIDEST = 16 };

/* a b + c, fused or not. */
KMP_INLINE double kmp_dop853_term(bool fused, double a, double b, double c)
{
    return fused ? fma(a, b, c) : a * b + c;
}

/* Adds the squares of both errors of the component that begins at i. */
KMP_INLINE void kmp_dop853_add_errors(size_t w, bool fused, size_t i, const kmp_dop853_step *s, double *restrict e5,
                                      double *restrict e3)
{
    double *const *k = s->k;
    const double *g[] = {k[1] + i, k[6] + i, k[7] + i, k[8] + i, k[9] + i, k[10] + i, k[11] + i, k[12] + i};
    double y1[KMP_DOP853_WIDEST], weight[KMP_DOP853_WIDEST];
    for (size_t l = 0; l < w; l++) { /* without stores to vectors, which might be the vectors that are read */
        double slope = kmp_dop853_b[0] * g[0][l], five = kmp_dop853_e5[0] * g[0][l];
        for (int j = 1; j < 8; j++) {
            slope = kmp_dop853_term(fused, kmp_dop853_b[j], g[j][l], slope);
            five = kmp_dop853_term(fused, kmp_dop853_e5[j], g[j][l], five);
        }
        double three = kmp_dop853_term(fused, -kmp_dop853_b3[0], g[0][l], slope);
        three = kmp_dop853_term(fused, -kmp_dop853_b3[1], g[4][l], three);
        three = kmp_dop853_term(fused, -kmp_dop853_b3[2], g[7][l], three);
        double y0 = s->y[i + l], y = kmp_dop853_term(fused, s->h[l], slope, y0);
        double larger = fabs(y0) > fabs(y) ? fabs(y0) : fabs(y);
        y1[l] = y;
        weight[l] = kmp_dop853_term(fused, s->rtol, larger, s->atol[i + l]);
        double part = 1.0 / weight[l]; /* one quotient where several lanes wait for it */
        five = fused ? five * part : five / weight[l];
        three = fused ? three * part : three / weight[l];
        e5[l] = kmp_dop853_term(fused, five, five, e5[l]);
        e3[l] = kmp_dop853_term(fused, three, three, e3[l]);
    }
    for (size_t l = 0; l < w; l++)
        s->y_new[i + l] = y1[l];
    for (size_t l = 0; l < w; l++)
        s->weight[i + l] = weight[l];
}

/* The solution of order 8, the error weights, and the combined error estimate |h| e5^2 / sqrt((e5^2 + 0.01 e3^2) n)
 * (II.10): 1 is at the tolerance. Fused: by fma(). */
KMP_INLINE void kmp_dop853_solution(size_t w, bool fused, size_t n, const kmp_dop853_step *s)
{
    double e5[KMP_DOP853_WIDEST] = {0}, e3[KMP_DOP853_WIDEST] = {0};
    for (size_t i = 0; i < n * w; i += w)
        kmp_dop853_add_errors(w, fused, i, s, e5, e3);
    for (size_t l = 0; l < w; l++) {
        double both = (e5[l] + 0.01 * e3[l]) * (double)n + 1e-300; /* no error, no unknowns: not 0 times infinity */
        s->error[l] = fabs(s->h[l]) * e5[l] * sqrt(1.0 / both);
    }
}
