/* SPDX-License-Identifier: BSD-3-Clause */
#include "andrews_by_hand.h"
#include "integrators/steppers/rk.h"
#include <kempe/runtime.h>

enum { N = BY_HAND_SIZE };
enum { BETA, THETA, GAMMA, DELTA, PHI, EPSILON, OMEGA, RATE };

#define INLINE static inline __attribute__((always_inline))

/* -- the mechanism: lengths, masses and inertias of the Test Set ------------------------------------- */

#define RR 0.007 /* O-F */
#define RA 0.00092
#define D  0.028 /* F-E */
#define DA 0.0115
#define SS 0.035 /* B-E */
#define SA 0.01874
#define SB 0.01043
#define SC 0.018 /* D on K3 */
#define SD 0.02
#define ZT 0.04 /* A-G, A-H */
#define ZF 0.02 /* G-E, H-E */
#define TA 0.02308
#define TB 0.00916
#define UA 0.01228
#define UB 0.00449
#define EA 0.00579 /* G to the centre of K4, H to that of K6 */
#define XA (-0.06934)
#define YA (-0.00227)
#define XB (-0.03635)
#define YB 0.03273
#define XC 0.014
#define YC 0.072
#define M1 0.04325
#define M2 0.00365
#define M3 0.02373
#define M4 0.00706
#define M5 0.07050
#define M6 0.00706
#define M7 0.05498
#define I1 2.194e-6
#define I2 4.410e-7
#define I3 5.255e-6
#define I4 5.667e-7
#define I5 1.169e-5
#define I6 5.667e-7
#define I7 1.912e-5

#define TORQUE    0.033
#define STIFFNESS 4530.0
#define FREE      0.07785

/* Constant parts of M. */
#define TWO   (I2 + M2 * DA * DA) /* K2 about F, K4 about G, K6 about H */
#define FOUR  (I4 + M4 * EA * EA)
#define SIX   (I6 + M6 * EA * EA)
#define ONE   (I1 + M1 * RA * RA + M2 * RR * RR + TWO)
#define THREE (I3 + M3 * (SA * SA + SB * SB))
#define FIVE  (I5 + M5 * (TA * TA + TB * TB) + M4 * ZT * ZT + FOUR)
#define SEVEN (I7 + M7 * (UA * UA + UB * UB) + M6 * ZT * ZT + SIX)

/* A block of two rows: its columns, and the inverse of its determinant. */
typedef struct pair {
    double xa, ya, xb, yb, inverse;
} pair;

INLINE pair pair_of(double xa, double ya, double xb, double yb)
{
    return (pair){xa, ya, xb, yb, 1 / (xa * yb - xb * ya)};
}

INLINE void solve(const pair *k, double x, double y, double *a, double *b)
{
    *a = (k->yb * x - k->xb * y) * k->inverse;
    *b = (k->xa * y - k->ya * x) * k->inverse;
}

/* dy, and the correction of v when asked for. */
INLINE void evaluate(const double *y, double *dy, double *dv)
{
    double s[N], c[N];
    kempe_sincos8_core_(y, s, c); /* the last of them is of no use */
    double rate = y[RATE];

    /* Angles from +x of K2, K4 and K6. */
    double s2 = s[BETA] * c[THETA] + c[BETA] * s[THETA], c2 = c[BETA] * c[THETA] - s[BETA] * s[THETA];
    double s4 = s[DELTA] * c[PHI] + c[DELTA] * s[PHI], c4 = c[DELTA] * c[PHI] - s[DELTA] * s[PHI];
    double s6 = s[EPSILON] * c[OMEGA] + c[EPSILON] * s[OMEGA], c6 = c[EPSILON] * c[OMEGA] - s[EPSILON] * s[OMEGA];

    /* E less the pivot, along each way; its derivatives, of which those by theta, Phi and Omega are vectors alone. */
    double x_f = RR * c[BETA], y_f = RR * s[BETA], x_2 = D * c2, y_2 = D * s2;
    double x_3 = SS * s[GAMMA], y_3 = SS * c[GAMMA]; /* E = B + (x_3, -y_3) */
    double x_g = ZT * c[DELTA], y_g = ZT * s[DELTA], x_4 = ZF * s4, y_4 = ZF * c4;
    double x_h = ZT * s[EPSILON], y_h = ZT * c[EPSILON], x_6 = ZF * c6, y_6 = ZF * s6;
    double bx = y_2 - y_f, by = x_f - x_2; /* dE/dbeta */
    pair k2 = pair_of(y_2, -x_2, -y_3, -x_3), k4 = pair_of(y_4 - y_g, x_g + x_4, y_4, x_4),
         k6 = pair_of(y_h - y_6, x_h + x_6, -y_6, x_6);

    /* Column of Bvu, and rates. */
    double b_t, b_g, b_d, b_p, b_e, b_o;
    solve(&k2, -bx, -by, &b_t, &b_g);
    double ex = y_3 * b_g, ey = x_3 * b_g;
    solve(&k4, ex, ey, &b_d, &b_p);
    solve(&k6, ex, ey, &b_e, &b_o);
    double qt = b_t * rate, qg = b_g * rate, qd = b_d * rate, qp = b_p * rate, qe = b_e * rate, qo = b_o * rate;

    /* Accelerations of v at beta'' = 0. */
    double w2 = rate + qt, w4 = qd + qp, w6 = qe + qo;
    double r2 = rate * rate, ww2 = w2 * w2, gg = qg * qg, dd = qd * qd, ww4 = w4 * w4, ee = qe * qe, ww6 = w6 * w6;
    double a_t, a_g, a_d, a_p, a_e, a_o;
    double zx = -gg * x_3, zy = gg * y_3;
    solve(&k2, zx + r2 * x_f - ww2 * x_2, zy + r2 * y_f - ww2 * y_2, &a_t, &a_g);
    zx += y_3 * a_g;
    zy += x_3 * a_g;
    solve(&k4, zx + dd * x_g + ww4 * x_4, zy + dd * y_g - ww4 * y_4, &a_d, &a_p);
    solve(&k6, zx + ee * x_h + ww6 * x_6, zy - ee * y_h + ww6 * y_6, &a_e, &a_o);

    /* M and C: the parts that change with theta, Phi, Omega; the spring's moment. */
    double m_t = M2 * DA * RR * c[THETA], f_t = M2 * DA * RR * s[THETA];
    double m_p = M4 * EA * ZT * s[PHI], f_p = M4 * EA * ZT * c[PHI];
    double m_o = M6 * EA * ZT * s[OMEGA], f_o = M6 * EA * ZT * c[OMEGA];
    double px = SD * c[GAMMA] + SC * s[GAMMA], py = SD * s[GAMMA] - SC * c[GAMMA];
    double lx = px + (XB - XC), ly = py + (YB - YC), length = sqrt(lx * lx + ly * ly);
    double pull = STIFFNESS * (length - FREE) / length;
    double c_b = f_t * (qt * (rate + w2)) - TORQUE, c_t = -f_t * r2, c_g = pull * (ly * px - lx * py);
    double c_d = f_p * (qp * (qd + w4)), c_p = -f_p * dd;
    double c_e = -f_o * (qo * (qe + w6)), c_o = f_o * ee;

    /* M X, then X' M X, and X' C + (M X)' a. */
    double m_b = (ONE - 2 * m_t) + (TWO - m_t) * b_t, m_2 = (TWO - m_t) + TWO * b_t, m_g = THREE * b_g;
    double m_d = (FIVE + 2 * m_p) * b_d + (FOUR + m_p) * b_p, m_4 = (FOUR + m_p) * b_d + FOUR * b_p;
    double m_e = (SEVEN - 2 * m_o) * b_e + (SIX - m_o) * b_o, m_6 = (SIX - m_o) * b_e + SIX * b_o;
    double mass = m_b + m_2 * b_t + m_g * b_g + (m_d * b_d + m_4 * b_p) + (m_e * b_e + m_6 * b_o);
    double force = c_b + c_t * b_t + c_g * b_g + (c_d * b_d + c_p * b_p) + (c_e * b_e + c_o * b_o);
    force += m_2 * a_t + m_g * a_g + (m_d * a_d + m_4 * a_p) + (m_e * a_e + m_6 * a_o);
    dy[BETA] = rate;
    dy[THETA] = qt;
    dy[GAMMA] = qg;
    dy[DELTA] = qd;
    dy[PHI] = qp;
    dy[EPSILON] = qe;
    dy[OMEGA] = qo;
    dy[RATE] = -force / mass;
    if (!dv)
        return;
    double hx = x_3 + XB - (x_f - x_2), hy = YB - y_3 - (y_f - y_2);
    solve(&k2, hx, hy, &dv[THETA], &dv[GAMMA]);
    double nx = XB + x_3 + y_3 * dv[GAMMA] - XA, ny = YB - y_3 + x_3 * dv[GAMMA] - YA;
    solve(&k4, nx - (x_g + x_4), ny - (y_g - y_4), &dv[DELTA], &dv[PHI]);
    solve(&k6, nx - (x_h + x_6), ny - (y_6 - y_h), &dv[EPSILON], &dv[OMEGA]);
}

void andrews_by_hand_rhs(const double *y, double *dy)
{
    evaluate(y, dy, NULL);
}

void andrews_by_hand_start(double *y)
{
    static const double start[N] = {-0.0617138900142764496358948458001, 0,
                                    0.455279819163070380255912382449,   0.487364979543842550225598953530,
                                    0.222668390165885884674473185609,   1.23054744454982119249735015568,
                                    -0.222668390165885884674473185609,  0};
    memcpy(y, start, sizeof start);
}

/* -- DOP853, with Kempe's control of steps ----------------------------------------------------------- */

#define SAFETY 0.8
#define BETA_  0.04
#define POWER  (1.0 / 8 - 0.2 * BETA_)

typedef struct state {
    double y[N], next[N], stage[N], w[N], dv[N], k[14][N];
    double tolerance, atol[N], t, h, error_old;
    int rejected;
} state;

#define STAGE(number, a, ...)                                                                                          \
    do {                                                                                                               \
        const double *const from[] = {__VA_ARGS__};                                                                    \
        for (int i = 0; i < N; i++) {                                                                                  \
            double sum = (a)[0] * from[0][i];                                                                          \
            _Pragma("GCC unroll 16") for (unsigned j = 1; j < sizeof(a) / sizeof *(a); j++) sum +=                     \
                (a)[j] * from[j][i];                                                                                   \
            x->stage[i] = x->y[i] + h * sum;                                                                           \
        }                                                                                                              \
        evaluate(x->stage, x->k[number], NULL);                                                                        \
    } while (0)

static void stages(state *x, double h)
{
    double(*k)[N] = x->k;
    STAGE(2, kmp_dop853_a2, k[1]);
    STAGE(3, kmp_dop853_a3, k[1], k[2]);
    STAGE(4, kmp_dop853_a4, k[1], k[3]);
    STAGE(5, kmp_dop853_a5, k[1], k[3], k[4]);
    STAGE(6, kmp_dop853_a6, k[1], k[4], k[5]);
    STAGE(7, kmp_dop853_a7, k[1], k[4], k[5], k[6]);
    STAGE(8, kmp_dop853_a8, k[1], k[4], k[5], k[6], k[7]);
    STAGE(9, kmp_dop853_a9, k[1], k[4], k[5], k[6], k[7], k[8]);
    STAGE(10, kmp_dop853_a10, k[1], k[4], k[5], k[6], k[7], k[8], k[9]);
    STAGE(11, kmp_dop853_a11, k[1], k[4], k[5], k[6], k[7], k[8], k[9], k[10]);
    STAGE(12, kmp_dop853_a12, k[1], k[4], k[5], k[6], k[7], k[8], k[9], k[10], k[11]);
}

static double error_of(state *x, double h)
{
    double e5 = 0, e3 = 0, (*k)[N] = x->k;
    for (int i = 0; i < N; i++) {
        double slope = kmp_dop853_b[0] * k[1][i] + kmp_dop853_b[1] * k[6][i] + kmp_dop853_b[2] * k[7][i] +
                       kmp_dop853_b[3] * k[8][i] + kmp_dop853_b[4] * k[9][i] + kmp_dop853_b[5] * k[10][i] +
                       kmp_dop853_b[6] * k[11][i] + kmp_dop853_b[7] * k[12][i];
        double five = kmp_dop853_e5[0] * k[1][i] + kmp_dop853_e5[1] * k[6][i] + kmp_dop853_e5[2] * k[7][i] +
                      kmp_dop853_e5[3] * k[8][i] + kmp_dop853_e5[4] * k[9][i] + kmp_dop853_e5[5] * k[10][i] +
                      kmp_dop853_e5[6] * k[11][i] + kmp_dop853_e5[7] * k[12][i];
        double three = slope - kmp_dop853_b3[0] * k[1][i] - kmp_dop853_b3[1] * k[9][i] - kmp_dop853_b3[2] * k[12][i];
        x->next[i] = x->y[i] + h * slope;
        x->w[i] = x->atol[i] + x->tolerance * fmax(fabs(x->y[i]), fabs(x->next[i]));
        e5 += five / x->w[i] * (five / x->w[i]);
        e3 += three / x->w[i] * (three / x->w[i]);
    }
    double both = e5 + 0.01 * e3;
    return both > 0 ? h * e5 / sqrt(both * N) : 0;
}

/* The end of a step: its derivative, and v back on the closures. */
static int close_step(state *x)
{
    evaluate(x->next, x->k[13], x->dv);
    for (int i = THETA; i <= OMEGA; i++)
        if (!(fabs(x->dv[i]) <= x->w[i]))
            return 0;
    for (int i = THETA; i <= OMEGA; i++)
        x->next[i] += x->dv[i];
    return 1;
}

/* Hairer's. */
static double first_step(state *x, double left)
{
    double slope = 0, size = 0, bend = 0;
    for (int i = 0; i < N; i++) {
        x->w[i] = x->atol[i] + x->tolerance * fabs(x->y[i]);
        slope += x->k[1][i] / x->w[i] * (x->k[1][i] / x->w[i]);
        size += x->y[i] / x->w[i] * (x->y[i] / x->w[i]);
    }
    double h = slope <= 1e-10 || size <= 1e-10 ? 1e-6 : 0.01 * sqrt(size / slope);
    h = fmin(h, left);
    for (int i = 0; i < N; i++)
        x->stage[i] = x->y[i] + h * x->k[1][i];
    evaluate(x->stage, x->k[2], NULL);
    for (int i = 0; i < N; i++)
        bend += (x->k[2][i] - x->k[1][i]) / x->w[i] * ((x->k[2][i] - x->k[1][i]) / x->w[i]);
    return fmin(fmin(100 * h, pow(0.01 / fmax(sqrt(bend) / h, sqrt(slope)), 1.0 / 8)), left);
}

/* True if the step was taken. */
static int step(state *x, double h, by_hand_run *run)
{
    stages(x, h);
    run->rhs += 11;
    double error = error_of(x, h);
    if (!(error <= 1)) {
        x->h = h / fmin(3, pow(error, POWER) / SAFETY);
        x->rejected = 1;
        return 0;
    }
    run->rhs++;
    if (!close_step(x)) {
        x->h = h / 2;
        x->rejected = 1;
        return 0;
    }
    double next = h / fmax(1.0 / 6, fmin(3, pow(error, POWER) / pow(x->error_old, BETA_) / SAFETY));
    x->h = x->rejected ? fmin(next, h) : next;
    x->error_old = fmax(error, 1e-4);
    x->rejected = 0;
    run->steps++;
    memcpy(x->y, x->next, sizeof x->y);
    memcpy(x->k[1], x->k[13], sizeof x->k[1]);
    return 1;
}

int andrews_by_hand_integrate(double t_end, double tolerance, double rate_scale, by_hand_run *run)
{
    state x = {.tolerance = tolerance, .error_old = 1e-4};
    *run = (by_hand_run){.rhs = 2};
    andrews_by_hand_start(x.y);
    for (int i = 0; i < N; i++)
        x.atol[i] = tolerance * (i == RATE ? rate_scale : 1);
    evaluate(x.y, x.k[1], NULL);
    x.h = first_step(&x, t_end);
    while (x.t < t_end) {
        double left = t_end - x.t, h = left < 1.01 * x.h ? left : left < 2 * x.h ? 0.5 * left : x.h;
        if (!(h > 1e-15 * t_end))
            return 1;
        double t = h < left ? x.t + h : t_end;
        if (step(&x, h, run))
            x.t = t;
    }
    memcpy(run->y, x.y, sizeof run->y);
    return 0;
}
