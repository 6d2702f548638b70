/* SPDX-License-Identifier: BSD-3-Clause */
/* Hides the tableau, the step-size control and the dense output of DOP853. Coefficients and estimators after
 * Hairer, Norsett, Wanner, Solving Ordinary Differential Equations I, 2nd ed., II.5 (method), II.6
 * (dense output), II.10 (error), and the authors' published code; step-size control: II.4 and Hairer, Wanner, II, IV.2.
 */
#include "integrators/dop853.h"

#include "base/memory.h"
#include "integrators/solver.h"

#include <float.h>
#include <math.h>
#include <string.h>

/* -- the method: row i holds the nonzero coefficients of stage i, in the order of the stages used ---- */

static const double C[17] = {0.0,
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

static const double A2[] = {5.26001519587677318785587544488e-2};
static const double A3[] = {1.97250569845378994544595329183e-2, 5.91751709536136983633785987549e-2};
static const double A4[] = {2.95875854768068491816892993775e-2, 8.87627564304205475450678981324e-2};
static const double A5[] = {2.41365134159266685502369798665e-1, -8.84549479328286085344864962717e-1,
                            9.24834003261792003115737966543e-1};
static const double A6[] = {3.7037037037037037037037037037e-2, 1.70828608729473871279604482173e-1,
                            1.25467687566822425016691814123e-1};
static const double A7[] = {3.7109375e-2, 1.70252211019544039314978060272e-1, 6.02165389804559606850219397283e-2,
                            -1.7578125e-2};
static const double A8[] = {3.70920001185047927108779319836e-2, 1.70383925712239993810214054705e-1,
                            1.07262030446373284651809199168e-1, -1.53194377486244017527936158236e-2,
                            8.27378916381402288758473766002e-3};
static const double A9[] = {6.24110958716075717114429577812e-1,  -3.36089262944694129406857109825,
                            -8.68219346841726006818189891453e-1, 2.75920996994467083049415600797e1,
                            2.01540675504778934086186788979e1,   -4.34898841810699588477366255144e1};
static const double A10[] = {4.77662536438264365890433908527e-1,  -2.48811461997166764192642586468,
                             -5.90290826836842996371446475743e-1, 2.12300514481811942347288949897e1,
                             1.52792336328824235832596922938e1,   -3.32882109689848629194453265587e1,
                             -2.03312017085086261358222928593e-2};
static const double A11[] = {-9.3714243008598732571704021658e-1, 5.18637242884406370830023853209,
                             1.09143734899672957818500254654,    -8.14978701074692612513997267357,
                             -1.85200656599969598641566180701e1, 2.27394870993505042818970056734e1,
                             2.49360555267965238987089396762,    -3.0467644718982195003823669022};
static const double A12[] = {
    2.27331014751653820792359768449,    -1.05344954667372501984066689879e1, -2.00087205822486249909675718444,
    -1.79589318631187989172765950534e1, 2.79488845294199600508499808837e1,  -2.85899827713502369474065508674,
    -8.87285693353062954433549289258,   1.23605671757943030647266201528e1,  6.43392746015763530355970484046e-1};
static const double A14[] = {5.61675022830479523392909219681e-2,  2.53500210216624811088794765333e-1,
                             -2.46239037470802489917441475441e-1, -1.24191423263816360469010140626e-1,
                             1.5329179827876569731206322685e-1,   8.20105229563468988491666602057e-3,
                             7.56789766054569976138603589584e-3,  -8.298e-3};
static const double A15[] = {3.18346481635021405060768473261e-2,  2.83009096723667755288322961402e-2,
                             5.35419883074385676223797384372e-2,  -5.49237485713909884646569340306e-2,
                             -1.08347328697249322858509316994e-4, 3.82571090835658412954920192323e-4,
                             -3.40465008687404560802977114492e-4, 1.41312443674632500278074618366e-1};
static const double A16[] = {-4.28896301583791923408573538692e-1, -4.69762141536116384314449447206,
                             7.68342119606259904184240953878,     4.06898981839711007970213554331,
                             3.56727187455281109270669543021e-1,  -1.39902416515901462129418009734e-3,
                             2.9475147891527723389556272149,      -9.15095847217987001081870187138};

/* Stages 1, 6 .. 12 of the 8th-order solution and of the 5th-order error; stages 1, 9, 12 of the 3rd-order one. */
static const double B[] = {5.42937341165687622380535766363e-2, 4.45031289275240888144113950566,
                           1.89151789931450038304281599044,    -5.8012039600105847814672114227,
                           3.1116436695781989440891606237e-1,  -1.52160949662516078556178806805e-1,
                           2.01365400804030348374776537501e-1, 4.47106157277725905176885569043e-2};
static const double E5[] = {0.1312004499419488073250102996e-1, -0.1225156446376204440720569753e1,
                            -0.4957589496572501915214079952,   0.1664377182454986536961530415e1,
                            -0.3503288487499736816886487290,   0.3341791187130174790297318841,
                            0.8192320648511571246570742613e-1, -0.2235530786388629525884427845e-1};
static const double B3[] = {0.244094488188976377952755905512, 0.733846688281611857341361741547,
                            0.0220588235294117647058823529412};

/* Dense output: stages 1, 6 .. 16 of the last four coefficients of the interpolant. */
enum { DENSE_TERMS = 12 };
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

/* Step-size control: the published code's, with the stabilising exponent beta. */
static const double SAFETY = 0.9, BETA = 0.04, SHRINK = 3.0, GROW = 6.0, ERROR_FLOOR = 1e-4;
enum { MAX_REJECT = 1000, STAGES = 16 };
/* A step is hopeless when this many of its size would be needed to the end; so many in a row are a collapse. */
#define HOPELESS 1e9
enum { MAX_HOPELESS = 100 };

struct kmp_dop853 {
    kmp_ode ode;
    kmp_tolerance tolerance;
    double t, t_old, t_end;
    double h;         /* the next step */
    double taken;     /* the last one */
    double error_old; /* of the last accepted step */
    bool rejected;    /* the last attempt was: no growth */
    int hopeless;     /* consecutive hopeless steps */
    bool dense_ready;
    double *y, *y_old, *dy; /* dy is k[13] after a step, k[1] within one */
    double *stage, *w;
    double *k[STAGES + 1]; /* k[1] .. k[16], numbered as published */
    double *interpolant[8];
    double *memory;
    kmp_ode_work work;
};

/* -- creation -------------------------------------------------------------------------------------- */

kmp_dop853 *kmp_dop853_new(const kmp_ode *ode, kmp_tolerance tolerance)
{
    enum { VECTORS = 4 + STAGES + 8 };
    kmp_dop853 *s = KMP_NEW(kmp_dop853, 1);
    double *v = s ? KMP_NEW(double, (size_t)VECTORS *(size_t)ode->n) : NULL;
    if (!v) {
        kmp_free(s);
        return NULL;
    }
    double **vectors[VECTORS] = {&s->y, &s->y_old, &s->stage, &s->w};
    for (int i = 0; i < STAGES; i++)
        vectors[4 + i] = &s->k[1 + i];
    for (int i = 0; i < 8; i++)
        vectors[4 + STAGES + i] = &s->interpolant[i];
    for (int i = 0; i < VECTORS; i++)
        *vectors[i] = v + (size_t)i * (size_t)ode->n;
    s->memory = v;
    s->dy = s->k[13];
    s->ode = *ode;
    s->tolerance = tolerance;
    return s;
}

void kmp_dop853_free(kmp_dop853 *s)
{
    if (s)
        kmp_free(s->memory);
    kmp_free(s);
}

/* -- start ----------------------------------------------------------------------------------------- */

static int call_rhs(kmp_dop853 *s, double t, const double *y, double *dy)
{
    s->work.rhs++;
    return s->ode.rhs(s->ode.self, t, y, dy);
}

/* sum of ((a - b) / w)^2; b NULL: 0 */
static double weighted_square(int n, const double *a, const double *b, const double *w)
{
    double sum = 0.0;
    for (int i = 0; i < n; i++) {
        double e = (b ? a[i] - b[i] : a[i]) / w[i];
        sum += e * e;
    }
    return sum;
}

/* Hairer's hinit (II.4): a step such that an explicit Euler step would err by 1e-2 of the solution's size, then
 * one from the second derivative seen over it. */
static int choose_first_step(kmp_dop853 *s)
{
    int n = s->ode.n;
    double longest = s->t_end - s->t;
    for (int i = 0; i < n; i++)
        s->w[i] = s->tolerance.atol[i] + s->tolerance.rtol * fabs(s->y[i]);
    double slope = weighted_square(n, s->dy, NULL, s->w), size = weighted_square(n, s->y, NULL, s->w);
    double h = slope <= 1e-10 || size <= 1e-10 ? 1e-6 : 0.01 * sqrt(size / slope);
    h = fmin(h, longest);
    int said = KMP_RETRY;
    for (int attempt = 0; said == KMP_RETRY && attempt < 10; attempt++) {
        h = attempt ? h / 4 : h;
        for (int i = 0; i < n; i++)
            s->stage[i] = s->y[i] + h * s->dy[i];
        said = call_rhs(s, s->t + h, s->stage, s->k[2]);
        s->work.refused += said == KMP_RETRY;
    }
    double bend = sqrt(weighted_square(n, s->k[2], s->dy, s->w)) / h, most = fmax(bend, sqrt(slope));
    double h1 = most <= 1e-15 ? fmax(1e-6, 1e-3 * h) : pow(0.01 / most, 1.0 / 8.0);
    s->h = fmin(fmin(100 * h, h1), longest);
    return said == KMP_HALT ? KMP_HALT : KMP_GO;
}

int kmp_dop853_start(kmp_dop853 *s, double t, const double *y, double t_end, double h0)
{
    s->t = s->t_old = t;
    s->t_end = t_end;
    s->h = h0;
    s->error_old = ERROR_FLOOR;
    s->rejected = s->dense_ready = false;
    s->hopeless = 0;
    s->dy = s->k[13];
    memcpy(s->y, y, (size_t)s->ode.n * sizeof *y);
    int said = call_rhs(s, t, s->y, s->dy);
    if (said == KMP_GO && h0 == 0.0 && t_end > t)
        said = choose_first_step(s);
    return said;
}

/* -- one attempt ----------------------------------------------------------------------------------- */

#define INLINE static inline __attribute__((always_inline))

/* out = y + h sum a[j] k[j]; unrolled over the terms, of which there are a fixed number at each use. */
INLINE void combine(int n, const double *y, double h, int terms, const double *a, const double *const *k,
                    double *restrict out)
{
    for (int i = 0; i < n; i++) {
        double sum = a[0] * k[0][i];
        for (int j = 1; j < terms; j++)
            sum += a[j] * k[j][i];
        out[i] = y[i] + h * sum;
    }
}

#define K(...)   ((const double *const[]){__VA_ARGS__})
#define TERMS(a) ((int)(sizeof(a) / sizeof *(a)))

/* k[stage] = f(t + c h, y + h sum a k) */
#define STAGE(stage_number, a, ...)                                                                                    \
    do {                                                                                                               \
        combine(n, y, h, TERMS(a), a, K(__VA_ARGS__), s->stage);                                                       \
        int said = call_rhs(s, t + C[stage_number] * h, s->stage, k[stage_number]);                                    \
        if (said != KMP_GO)                                                                                            \
            return said;                                                                                               \
    } while (0)

static int first_stages(kmp_dop853 *s, double h)
{
    int n = s->ode.n;
    double t = s->t, *y = s->y, **k = s->k;
    STAGE(2, A2, k[1]);
    STAGE(3, A3, k[1], k[2]);
    STAGE(4, A4, k[1], k[3]);
    STAGE(5, A5, k[1], k[3], k[4]);
    STAGE(6, A6, k[1], k[4], k[5]);
    STAGE(7, A7, k[1], k[4], k[5], k[6]);
    return KMP_GO;
}

static int last_stages(kmp_dop853 *s, double h)
{
    int n = s->ode.n;
    double t = s->t, *y = s->y, **k = s->k;
    STAGE(8, A8, k[1], k[4], k[5], k[6], k[7]);
    STAGE(9, A9, k[1], k[4], k[5], k[6], k[7], k[8]);
    STAGE(10, A10, k[1], k[4], k[5], k[6], k[7], k[8], k[9]);
    STAGE(11, A11, k[1], k[4], k[5], k[6], k[7], k[8], k[9], k[10]);
    STAGE(12, A12, k[1], k[4], k[5], k[6], k[7], k[8], k[9], k[10], k[11]);
    return KMP_GO;
}

/* The 8th-order solution in y_old (for the time being), the weights, and the combined error estimate
 * |h| e5^2 / sqrt((e5^2 + 0.01 e3^2) n) (II.10): 1 is at the tolerance. */
static double solution_and_error(kmp_dop853 *s, double h)
{
    int n = s->ode.n;
    double **k = s->k, rtol = s->tolerance.rtol, e5 = 0.0, e3 = 0.0;
    const double *y0 = s->y, *atol = s->tolerance.atol;
    double *restrict y1 = s->y_old, *restrict w = s->w;
    for (int i = 0; i < n; i++) {
        double g[] = {k[1][i], k[6][i], k[7][i], k[8][i], k[9][i], k[10][i], k[11][i], k[12][i]};
        double slope = B[0] * g[0], error5 = E5[0] * g[0];
        for (int j = 1; j < 8; j++) {
            slope += B[j] * g[j];
            error5 += E5[j] * g[j];
        }
        double error3 = slope - B3[0] * g[0] - B3[1] * g[4] - B3[2] * g[7];
        y1[i] = y0[i] + h * slope;
        w[i] = atol[i] + rtol * fmax(fabs(y0[i]), fabs(y1[i]));
        error5 /= w[i];
        error3 /= w[i];
        e5 += error5 * error5;
        e3 += error3 * error3;
    }
    double both = e5 + 0.01 * e3;
    return both == 0.0 ? 0.0 : fabs(h) * e5 * sqrt(1.0 / (both * n));
}

static void swap(double **a, double **b)
{
    double *t = *a;
    *a = *b;
    *b = t;
}

/* What became of an attempt. */
typedef enum outcome { TAKEN, BAD_ERROR, BAD_STAGE, BAD_STEP, HALTED } outcome;

/* Stages, error test, derivative at the end, the road's consent. The new y is left in y_old. */
static outcome attempt(kmp_dop853 *s, double h, double t_new, double *error)
{
    int said = first_stages(s, h);
    if (said == KMP_GO)
        said = last_stages(s, h);
    if (said != KMP_GO)
        return said == KMP_RETRY ? BAD_STAGE : HALTED;
    *error = solution_and_error(s, h);
    if (!(*error <= 1.0))
        return BAD_ERROR;
    said = call_rhs(s, t_new, s->y_old, s->k[13]);
    if (said != KMP_GO)
        return said == KMP_RETRY ? BAD_STAGE : HALTED;
    said = s->ode.accept ? s->ode.accept(s->ode.self, t_new, s->y_old, s->k[13], s->w) : KMP_GO;
    if (said != KMP_GO)
        return said == KMP_RETRY ? BAD_STEP : HALTED;
    return TAKEN;
}

/* -- step-size control ------------------------------------------------------------------------------ */

/* The next step after an accepted one (Hairer, Wanner, II, IV.2, with the published bounds). */
static double after_accepted(const kmp_dop853 *s, double h, double error)
{
    double factor = pow(error, 1.0 / 8.0 - 0.2 * BETA) / pow(s->error_old, BETA) / SAFETY;
    double next = h / fmax(1.0 / GROW, fmin(SHRINK, factor));
    return s->rejected ? fmin(next, h) : next;
}

static double after_rejected(double h, double error)
{
    if (!(error <= DBL_MAX))
        return h / SHRINK;
    return h / fmin(SHRINK, pow(error, 1.0 / 8.0 - 0.2 * BETA) / SAFETY);
}

/* The step to try, and where it ends: at t_end exactly when it would come near, half way when little more
 * than one step is left. */
static double next_step(const kmp_dop853 *s, double *t_new)
{
    double left = s->t_end - s->t;
    double h = left < 1.01 * s->h ? left : left < 2.0 * s->h ? 0.5 * left : s->h;
    *t_new = h == left ? s->t_end : s->t + h;
    return h;
}

static void take(kmp_dop853 *s, double h, double t_new, double error)
{
    s->work.steps++;
    s->h = after_accepted(s, h, error);
    s->error_old = fmax(error, ERROR_FLOOR);
    s->rejected = false;
    s->taken = h;
    s->t = t_new;
    s->dy = s->k[13];
    swap(&s->y, &s->y_old);
}

static void refuse(kmp_dop853 *s, outcome what, double h, double error)
{
    if (what == BAD_ERROR)
        s->work.rejected++;
    else
        s->work.refused++;
    s->h = what == BAD_ERROR ? after_rejected(h, error) : what == BAD_STAGE ? h / 4 : h / 2;
    s->rejected = true;
}

int kmp_dop853_step(kmp_dop853 *s)
{
    s->t_old = s->t;
    s->dense_ready = false;
    if (!(s->t < s->t_end))
        return KMP_GO;
    if (s->dy == s->k[13]) {
        swap(&s->k[1], &s->k[13]);
        s->dy = s->k[1];
    }
    for (int tries = 0; tries < MAX_REJECT; tries++) {
        double t_new, error = 0.0, h = next_step(s, &t_new);
        if (!(h >= 16 * DBL_EPSILON * fabs(s->t)) || !(t_new > s->t) || s->hopeless > MAX_HOPELESS)
            return KMP_RETRY;
        outcome what = attempt(s, h, t_new, &error);
        if (what == HALTED)
            return KMP_HALT;
        if (what == TAKEN) {
            s->hopeless = HOPELESS * h < s->t_end - s->t ? s->hopeless + 1 : 0;
            take(s, h, t_new, error);
            return KMP_GO;
        }
        refuse(s, what, h, error);
    }
    return KMP_RETRY;
}

/* -- dense output ---------------------------------------------------------------------------------- */

static int extra_stages(kmp_dop853 *s)
{
    int n = s->ode.n;
    double t = s->t_old, h = s->taken, *y = s->y_old, **k = s->k;
    STAGE(14, A14, k[1], k[7], k[8], k[9], k[10], k[11], k[12], k[13]);
    STAGE(15, A15, k[1], k[6], k[7], k[8], k[11], k[12], k[13], k[14]);
    STAGE(16, A16, k[1], k[6], k[7], k[8], k[9], k[13], k[14], k[15]);
    return KMP_GO;
}

/* II.6: the values and slopes at both ends, and four more coefficients. */
static int prepare_dense(kmp_dop853 *s)
{
    int n = s->ode.n, said = extra_stages(s);
    if (said != KMP_GO)
        return said;
    double h = s->taken, **r = s->interpolant, **k = s->k;
    for (int i = 0; i < n; i++) {
        double rise = s->y[i] - s->y_old[i], bend = h * k[1][i] - rise;
        r[0][i] = s->y_old[i];
        r[1][i] = rise;
        r[2][i] = bend;
        r[3][i] = rise - h * k[13][i] - bend;
        for (int j = 0; j < 4; j++) {
            double sum = D[j][0] * k[1][i];
            for (int l = 1; l < DENSE_TERMS; l++)
                sum += D[j][l] * k[l + 5][i];
            r[4 + j][i] = h * sum;
        }
    }
    s->dense_ready = true;
    return KMP_GO;
}

int kmp_dop853_dense(kmp_dop853 *s, double t, double *y)
{
    int n = s->ode.n;
    if (!(s->t > s->t_old)) { /* no step yet, or the last one failed */
        memcpy(y, s->y, (size_t)n * sizeof *y);
        return KMP_GO;
    }
    int said = s->dense_ready ? KMP_GO : prepare_dense(s);
    if (said != KMP_GO)
        return said;
    double x = (t - s->t_old) / s->taken, z = 1.0 - x, **r = s->interpolant;
    for (int i = 0; i < n; i++) {
        double high = r[4][i] + x * (r[5][i] + z * (r[6][i] + x * r[7][i]));
        y[i] = r[0][i] + x * (r[1][i] + z * (r[2][i] + x * (r[3][i] + z * high)));
    }
    return KMP_GO;
}

/* -- queries --------------------------------------------------------------------------------------- */

double kmp_dop853_t(const kmp_dop853 *s)
{
    return s->t;
}

double kmp_dop853_t_old(const kmp_dop853 *s)
{
    return s->t_old;
}

const double *kmp_dop853_y(const kmp_dop853 *s)
{
    return s->y;
}

const double *kmp_dop853_dy(const kmp_dop853 *s)
{
    return s->dy;
}

kmp_ode_work kmp_dop853_work(const kmp_dop853 *s)
{
    return s->work;
}

/* -- behind the socket ----------------------------------------------------------------------------- */

static void *create(const kmp_solver_setup *setup)
{
    kmp_dop853 *s = kmp_dop853_new(setup->ode, setup->tolerance);
    if (!s)
        (void)kmp_fail_memory(setup->context);
    return s;
}

static void release(void *solver)
{
    kmp_dop853_free(solver);
}

static kempe_status start(void *solver, double t, const double *y, const double *yp, double t_end, double h0)
{
    (void)yp;
    return kmp_dop853_start(solver, t, y, t_end, h0) == KMP_GO ? KEMPE_OK : KEMPE_E_FAILED;
}

static kempe_status step(void *solver)
{
    return kmp_dop853_step(solver) == KMP_GO ? KEMPE_OK : KEMPE_E_FAILED;
}

static double end_of_step(const void *solver)
{
    return kmp_dop853_t(solver);
}

static double start_of_step(const void *solver)
{
    return kmp_dop853_t_old(solver);
}

static kempe_status dense(void *solver, double t, double *y, double *yp)
{
    kmp_dop853 *s = solver;
    (void)yp;
    if (t == s->t) {
        memcpy(y, s->y, (size_t)s->ode.n * sizeof *y);
        return KEMPE_OK;
    }
    return kmp_dop853_dense(s, t, y) == KMP_GO ? KEMPE_OK : KEMPE_E_FAILED;
}

static kmp_solver_work work(const void *solver)
{
    kmp_ode_work w = kmp_dop853_work(solver);
    return (kmp_solver_work){.steps = w.steps, .rejected = w.rejected, .refused = w.refused, .rhs = w.rhs};
}

const kmp_solver_kind kmp_solver_dop853 = {.name = "dop853",
                                           .corrects = true,
                                           .standard = true,
                                           .create = create,
                                           .release = release,
                                           .start = start,
                                           .step = step,
                                           .t = end_of_step,
                                           .t_old = start_of_step,
                                           .dense = dense,
                                           .work = work};
