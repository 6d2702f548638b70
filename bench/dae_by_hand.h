/* SPDX-License-Identifier: BSD-3-Clause */
/* Andrews' squeezing mechanism as one would write it by hand for IDA: equations of the Test Set for IVP Solvers (Mazzia
 * and Magherini; Hairer and Wanner, Solving ODEs II, VII.7), with sines and cosines taken once, constants gathered and
 * no operation with a zero, in four forms of the DAE, and their exact iteration matrices. y = (q, v, lambda[, mu]);
 * q = beta, theta, gamma, phi, delta, omega, epsilon. Signs of multipliers as there: M v' + G' lambda = f. */
#ifndef KEMPE_BENCH_DAE_BY_HAND_H
#define KEMPE_BENCH_DAE_BY_HAND_H

#include <math.h>
#include <stdbool.h>
#include <string.h>

enum { BY_HAND_N = 7, BY_HAND_M = 6, BY_HAND_MOST = 26, BY_HAND_ENTRIES = 256 };

typedef enum by_hand_form {
    BY_HAND_STABILIZED1,
    BY_HAND_GGL,
    BY_HAND_INDEX2,
    BY_HAND_INDEX1,
    BY_HAND_FORMS
} by_hand_form;

static inline bool by_hand_has_mu(by_hand_form form)
{
    return form == BY_HAND_STABILIZED1 || form == BY_HAND_GGL;
}

static inline int by_hand_size(by_hand_form form)
{
    return 2 * BY_HAND_N + (by_hand_has_mu(form) ? 2 : 1) * BY_HAND_M;
}

static const double m1 = 0.04325, m2 = 0.00365, m3 = 0.02373, m4 = 0.00706, m5 = 0.07050, m6 = 0.00706, m7 = 0.05498;
static const double i1 = 2.194e-6, i2 = 4.410e-7, i3 = 5.255e-6, i4 = 5.667e-7, i5 = 1.169e-5, i6 = 5.667e-7,
                    i7 = 1.912e-5;
static const double xa = -0.06934, ya = -0.00227, xb = -0.03635, yb = 0.03273, xc = 0.014, yc = 0.072, c0 = 4530;
static const double d = 0.028, da = 0.0115, e = 0.02, ea = 0.01421, rr = 0.007, ra = 0.00092, l0 = 0.07785, ss = 0.035;
static const double sa = 0.01874, sb = 0.01043, sc = 0.018, sd = 0.02, ta = 0.02308, tb = 0.00916, u = 0.04;
static const double ua = 0.01228, ub = 0.00449, zf = 0.02, zt = 0.04, fa = 0.01421, mom = 0.033;

/* Products of the constants that stand in the equations; the compiler folds them. */
#define K2 (m2 * da * rr)
#define K4 (m4 * zt * (e - ea))
#define K6 (m6 * u * (zf - fa))

/* Lengths times sines and cosines: of q0, q2, q4, q6 and of the sums q0 + q1, q3 + q4, q5 + q6. */
typedef struct by_hand_angles {
    double s1, c1, s3, c3, s5, c5;                         /* sines and cosines alone */
    double rs, rc, ds, dc, gs, gc, es, ec, ts, tc, fs, fc; /* rr 0, d 01, ss 2, e 34, zt 4, zf 56 */
    double us, uc;                                         /* u 6 */
    double xs, ys, xd, yd;                                 /* of the spring's point: about q2, and from its other end */
} by_hand_angles;

static inline by_hand_angles by_hand_look(const double *q)
{
    double s0 = sin(q[0]), k0 = cos(q[0]), s1 = sin(q[1]), k1 = cos(q[1]), s2 = sin(q[2]), k2 = cos(q[2]);
    double s3 = sin(q[3]), k3 = cos(q[3]), s4 = sin(q[4]), k4 = cos(q[4]), s5 = sin(q[5]), k5 = cos(q[5]);
    double s6 = sin(q[6]), k6 = cos(q[6]);
    by_hand_angles a = {.s1 = s1, .c1 = k1, .s3 = s3, .c3 = k3, .s5 = s5, .c5 = k5};
    a.rs = rr * s0;
    a.rc = rr * k0;
    a.ds = d * (s0 * k1 + k0 * s1);
    a.dc = d * (k0 * k1 - s0 * s1);
    a.gs = ss * s2;
    a.gc = ss * k2;
    a.es = e * (s3 * k4 + k3 * s4);
    a.ec = e * (k3 * k4 - s3 * s4);
    a.ts = zt * s4;
    a.tc = zt * k4;
    a.fs = zf * (s5 * k6 + k5 * s6);
    a.fc = zf * (k5 * k6 - s5 * s6);
    a.us = u * s6;
    a.uc = u * k6;
    a.xs = sd * k2 + sc * s2;
    a.ys = sd * s2 - sc * k2;
    a.xd = a.xs + xb - xc;
    a.yd = a.ys + yb - yc;
    return a;
}

/* M's entries: lower triangles of the blocks (0 1), (2), (3 4), (5 6). */
typedef struct by_hand_mass {
    double m00, m10, m11, m22, m33, m43, m44, m55, m65, m66;
} by_hand_mass;

static inline by_hand_mass by_hand_mass_at(const by_hand_angles *a)
{
    double ee = e - ea, ff = zf - fa;
    return (by_hand_mass){.m00 = m1 * ra * ra + m2 * (rr * rr + da * da) + i1 + i2 - 2 * K2 * a->c1,
                          .m10 = m2 * da * da + i2 - K2 * a->c1,
                          .m11 = m2 * da * da + i2,
                          .m22 = m3 * (sa * sa + sb * sb) + i3,
                          .m33 = m4 * ee * ee + i4,
                          .m43 = m4 * ee * ee + i4 + K4 * a->s3,
                          .m44 = m4 * (zt * zt + ee * ee) + m5 * (ta * ta + tb * tb) + i4 + i5 + 2 * K4 * a->s3,
                          .m55 = m6 * ff * ff + i6,
                          .m65 = m6 * ff * ff + i6 - K6 * a->s5,
                          .m66 = m6 * (ff * ff + u * u) + m7 * (ua * ua + ub * ub) + i6 + i7 - 2 * K6 * a->s5};
}

/* The columns of G that are alike in all loops; the others, x and y of each column. */
typedef struct by_hand_g {
    double x0, y0, x1, y1, x2, y2, x3, y3, x4, y4, x5, y5, x6, y6;
} by_hand_g;

static inline by_hand_g by_hand_g_at(const by_hand_angles *a)
{
    return (by_hand_g){.x0 = a->ds - a->rs,
                       .y0 = a->rc - a->dc,
                       .x1 = a->ds,
                       .y1 = -a->dc,
                       .x2 = -a->gc,
                       .y2 = -a->gs,
                       .x3 = -a->ec,
                       .y3 = -a->es,
                       .x4 = a->ts - a->ec,
                       .y4 = -a->es - a->tc,
                       .x5 = a->fs,
                       .y5 = -a->fc,
                       .x6 = a->fs - a->uc,
                       .y6 = -a->fc - a->us};
}

/* out += G' x */
static inline void by_hand_add_transposed(const by_hand_g *g, const double *x, double *out)
{
    double sx = x[0] + x[2] + x[4], sy = x[1] + x[3] + x[5];
    out[0] += g->x0 * sx + g->y0 * sy;
    out[1] += g->x1 * sx + g->y1 * sy;
    out[2] += g->x2 * x[0] + g->y2 * x[1];
    out[3] += g->x3 * x[2] + g->y3 * x[3];
    out[4] += g->x4 * x[2] + g->y4 * x[3];
    out[5] += g->x5 * x[4] + g->y5 * x[5];
    out[6] += g->x6 * x[4] + g->y6 * x[5];
}

/* out += factor G x */
static inline void by_hand_add_times(const by_hand_g *g, const double *x, double factor, double *out)
{
    double sx = g->x0 * x[0] + g->x1 * x[1], sy = g->y0 * x[0] + g->y1 * x[1];
    out[0] += factor * (sx + g->x2 * x[2]);
    out[1] += factor * (sy + g->y2 * x[2]);
    out[2] += factor * (sx + g->x3 * x[3] + g->x4 * x[4]);
    out[3] += factor * (sy + g->y3 * x[3] + g->y4 * x[4]);
    out[4] += factor * (sx + g->x5 * x[5] + g->x6 * x[6]);
    out[5] += factor * (sy + g->y5 * x[5] + g->y6 * x[6]);
}

/* out += factor g */
static inline void by_hand_add_closure(const by_hand_angles *a, double factor, double *out)
{
    double x = a->rc - a->dc, y = a->rs - a->ds;
    out[0] += factor * (x - a->gs - xb);
    out[1] += factor * (y + a->gc - yb);
    out[2] += factor * (x - a->es - a->tc - xa);
    out[3] += factor * (y + a->ec - a->ts - ya);
    out[4] += factor * (x - a->fc - a->us - xa);
    out[5] += factor * (y - a->fs + a->uc - ya);
}

/* out += (d/dt G) v */
static inline void by_hand_add_gamma(const by_hand_angles *a, const double *v, double *out)
{
    double v0 = v[0] * v[0], w1 = (v[0] + v[1]) * (v[0] + v[1]), v2 = v[2] * v[2], v4 = v[4] * v[4], v6 = v[6] * v[6];
    double w4 = (v[3] + v[4]) * (v[3] + v[4]), w6 = (v[5] + v[6]) * (v[5] + v[6]);
    double x = a->dc * w1 - a->rc * v0, y = a->ds * w1 - a->rs * v0;
    out[0] += x + a->gs * v2;
    out[1] += y - a->gc * v2;
    out[2] += x + a->es * w4 + a->tc * v4;
    out[3] += y - a->ec * w4 + a->ts * v4;
    out[4] += x + a->fc * w6 + a->us * v6;
    out[5] += y + a->fs * w6 - a->uc * v6;
}

/* -- the residual ------------------------------------------------------------------------------------- */

/* out = M a - f */
static inline void by_hand_dynamics(const by_hand_angles *n, const double *v, const double *a, double *out)
{
    by_hand_mass m = by_hand_mass_at(n);
    double pull = c0 * (1 - l0 / sqrt(n->xd * n->xd + n->yd * n->yd));
    out[0] = m.m00 * a[0] + m.m10 * a[1] - mom + K2 * n->s1 * v[1] * (v[1] + 2 * v[0]);
    out[1] = m.m10 * a[0] + m.m11 * a[1] - K2 * n->s1 * v[0] * v[0];
    out[2] = m.m22 * a[2] + pull * (n->yd * n->xs - n->xd * n->ys);
    out[3] = m.m33 * a[3] + m.m43 * a[4] - K4 * n->c3 * v[4] * v[4];
    out[4] = m.m43 * a[3] + m.m44 * a[4] + K4 * n->c3 * v[3] * (v[3] + 2 * v[4]);
    out[5] = m.m55 * a[5] + m.m65 * a[6] + K6 * n->c5 * v[6] * v[6];
    out[6] = m.m65 * a[5] + m.m66 * a[6] - K6 * n->c5 * v[5] * (v[5] + 2 * v[6]);
}

/* `gain` is that of Baumgarte's form. */
static inline void by_hand_residual(by_hand_form form, double gain, const double *y, const double *yp, double *out)
{
    const double *v = y + BY_HAND_N, *a = yp + BY_HAND_N, *multipliers = form == BY_HAND_STABILIZED1 ? yp : y;
    const double *lambda = multipliers + 2 * BY_HAND_N;
    double *rows = out + 2 * BY_HAND_N;
    by_hand_angles at = by_hand_look(y);
    by_hand_g g = by_hand_g_at(&at);
    for (int i = 0; i < BY_HAND_N; i++)
        out[i] = yp[i] - v[i];
    by_hand_dynamics(&at, v, a, out + BY_HAND_N);
    by_hand_add_transposed(&g, lambda, out + BY_HAND_N);
    memset(rows, 0, BY_HAND_M * sizeof *rows);
    if (by_hand_has_mu(form)) {
        by_hand_add_transposed(&g, lambda + BY_HAND_M, out);
        by_hand_add_closure(&at, 1, rows);
        rows += BY_HAND_M;
        memset(rows, 0, BY_HAND_M * sizeof *rows);
    }
    by_hand_add_times(&g, v, form == BY_HAND_INDEX1 ? 2 * gain : 1, rows);
    if (form == BY_HAND_INDEX1) {
        by_hand_add_times(&g, a, 1, rows);
        by_hand_add_gamma(&at, v, rows);
        by_hand_add_closure(&at, gain * gain, rows);
    }
}

/* -- its iteration matrix ----------------------------------------------------------------------------- */

/* Entries are put in one order. The first time their places are noted, from which compressed columns are made; later
 * they go straight where they belong. */
typedef struct by_hand_matrix {
    int size, count, next;
    long row[BY_HAND_ENTRIES], col[BY_HAND_ENTRIES];       /* as put */
    long start[BY_HAND_MOST + 1], sorted[BY_HAND_ENTRIES]; /* compressed columns */
    int at[BY_HAND_ENTRIES];                               /* where each one put goes */
    double *value;                                         /* NULL the first time */
} by_hand_matrix;

static inline void by_hand_put(by_hand_matrix *m, int row, int col, double value)
{
    int k = m->next++;
    if (m->value) {
        m->value[m->at[k]] = value;
        return;
    }
    m->row[k] = row;
    m->col[k] = col;
}

static inline void by_hand_compress(by_hand_matrix *m)
{
    int at = 0;
    m->count = m->next;
    for (int col = 0; col < m->size; col++) {
        m->start[col] = at;
        for (int row = 0; row < m->size; row++)
            for (int k = 0; k < m->count; k++)
                if (m->row[k] == row && m->col[k] == col) {
                    m->sorted[at] = row;
                    m->at[k] = at++;
                }
    }
    m->start[m->size] = at;
}

/* factor G at (row, col), and factor G' */
static inline void by_hand_put_g(by_hand_matrix *m, const by_hand_g *g, double factor, int row, int col,
                                 bool transposed)
{
    const double x[BY_HAND_N] = {g->x0, g->x1, g->x2, g->x3, g->x4, g->x5, g->x6};
    const double y[BY_HAND_N] = {g->y0, g->y1, g->y2, g->y3, g->y4, g->y5, g->y6};
    static const int first[BY_HAND_N] = {0, 0, 0, 2, 2, 4, 4};
    for (int k = 0; k < BY_HAND_N; k++)
        for (int r = first[k]; r < (k < 2 ? BY_HAND_M : first[k] + 2); r++) {
            double entry = factor * (r % 2 ? y[k] : x[k]);
            by_hand_put(m, row + (transposed ? k : r), col + (transposed ? r : k), entry);
        }
}

/* out = the derivative of G w by q, in the shape of G; w any. */
static inline by_hand_g by_hand_turn(const by_hand_angles *a, const double *w)
{
    double w1 = w[0] + w[1], w4 = w[3] + w[4], w6 = w[5] + w[6];
    by_hand_g g = {.x1 = a->dc * w1,
                   .y1 = a->ds * w1,
                   .x2 = a->gs * w[2],
                   .y2 = -a->gc * w[2],
                   .x3 = a->es * w4,
                   .y3 = -a->ec * w4,
                   .x5 = a->fc * w6,
                   .y5 = a->fs * w6};
    g.x0 = g.x1 - a->rc * w[0];
    g.y0 = g.y1 - a->rs * w[0];
    g.x4 = g.x3 + a->tc * w[4];
    g.y4 = g.y3 + a->ts * w[4];
    g.x6 = g.x5 + a->us * w[6];
    g.y6 = g.y5 - a->uc * w[6];
    return g;
}

/* The derivative of gamma by q, in the shape of G. */
static inline by_hand_g by_hand_turn_gamma(const by_hand_angles *a, const double *v)
{
    double w1 = (v[0] + v[1]) * (v[0] + v[1]), w4 = (v[3] + v[4]) * (v[3] + v[4]), w6 = (v[5] + v[6]) * (v[5] + v[6]);
    by_hand_g g = {.x1 = -a->ds * w1,
                   .y1 = a->dc * w1,
                   .x2 = a->gc * v[2] * v[2],
                   .y2 = a->gs * v[2] * v[2],
                   .x3 = a->ec * w4,
                   .y3 = a->es * w4,
                   .x5 = -a->fs * w6,
                   .y5 = a->fc * w6};
    g.x0 = g.x1 + a->rs * v[0] * v[0];
    g.y0 = g.y1 - a->rc * v[0] * v[0];
    g.x4 = g.x3 - a->ts * v[4] * v[4];
    g.y4 = g.y3 + a->tc * v[4] * v[4];
    g.x6 = g.x5 + a->uc * v[6] * v[6];
    g.y6 = g.y5 + a->us * v[6] * v[6];
    return g;
}

static inline by_hand_g by_hand_sum(by_hand_g a, double factor, by_hand_g b)
{
    return (by_hand_g){a.x0 + factor * b.x0, a.y0 + factor * b.y0, a.x1 + factor * b.x1, a.y1 + factor * b.y1,
                       a.x2 + factor * b.x2, a.y2 + factor * b.y2, a.x3 + factor * b.x3, a.y3 + factor * b.y3,
                       a.x4 + factor * b.x4, a.y4 + factor * b.y4, a.x5 + factor * b.x5, a.y5 + factor * b.y5,
                       a.x6 + factor * b.x6, a.y6 + factor * b.y6};
}

/* The derivative of G' w by q: a symmetric matrix in the blocks of M. */
static inline by_hand_mass by_hand_curvature(const by_hand_angles *a, const double *w)
{
    double sx = w[0] + w[2] + w[4], sy = w[1] + w[3] + w[5];
    by_hand_mass h = {.m11 = a->dc * sx + a->ds * sy,
                      .m22 = a->gs * w[0] - a->gc * w[1],
                      .m33 = a->es * w[2] - a->ec * w[3],
                      .m55 = a->fc * w[4] + a->fs * w[5]};
    h.m10 = h.m11;
    h.m00 = h.m11 - a->rc * sx - a->rs * sy;
    h.m43 = h.m33;
    h.m44 = h.m33 + a->tc * w[2] + a->ts * w[3];
    h.m65 = h.m55;
    h.m66 = h.m55 + a->us * w[4] - a->uc * w[5];
    return h;
}

/* Ten blocks' entries at (row, col), the upper ones as given. */
static inline void by_hand_put_blocks(by_hand_matrix *m, const by_hand_mass *b, double m01, double m34, double m56,
                                      int row, int col)
{
    by_hand_put(m, row, col, b->m00);
    by_hand_put(m, row + 1, col, b->m10);
    by_hand_put(m, row, col + 1, m01);
    by_hand_put(m, row + 1, col + 1, b->m11);
    by_hand_put(m, row + 2, col + 2, b->m22);
    by_hand_put(m, row + 3, col + 3, b->m33);
    by_hand_put(m, row + 4, col + 3, b->m43);
    by_hand_put(m, row + 3, col + 4, m34);
    by_hand_put(m, row + 4, col + 4, b->m44);
    by_hand_put(m, row + 5, col + 5, b->m55);
    by_hand_put(m, row + 6, col + 5, b->m65);
    by_hand_put(m, row + 5, col + 6, m56);
    by_hand_put(m, row + 6, col + 6, b->m66);
}

/* Derivative of M a - f + G' lambda by q. */
static inline void by_hand_put_stiffness(by_hand_matrix *m, const by_hand_angles *n, const double *v, const double *a,
                                         const double *lambda)
{
    by_hand_mass k = by_hand_curvature(n, lambda);
    double m01 = k.m10, m34 = k.m43, m56 = k.m65, square = n->xd * n->xd + n->yd * n->yd, length = sqrt(square);
    double p = n->yd * n->xs - n->xd * n->ys;
    double turned = n->xs * n->xs + n->ys * n->ys - n->xd * n->xs - n->yd * n->ys;
    m01 += K2 * (n->s1 * (2 * a[0] + a[1]) + n->c1 * v[1] * (v[1] + 2 * v[0]));
    k.m11 += K2 * (n->s1 * a[0] - n->c1 * v[0] * v[0]);
    k.m22 += c0 * ((1 - l0 / length) * turned + l0 * p * p / (square * length));
    k.m33 += K4 * (n->c3 * a[4] + n->s3 * v[4] * v[4]);
    k.m43 += K4 * (n->c3 * (a[3] + 2 * a[4]) - n->s3 * v[3] * (v[3] + 2 * v[4]));
    k.m55 -= K6 * (n->c5 * a[6] + n->s5 * v[6] * v[6]);
    k.m65 -= K6 * (n->c5 * (a[5] + 2 * a[6]) - n->s5 * v[5] * (v[5] + 2 * v[6]));
    by_hand_put_blocks(m, &k, m01, m34, m56, BY_HAND_N, 0);
}

/* Derivative of that sum by v, plus cj times that by v'. */
static inline void by_hand_put_damping(by_hand_matrix *m, const by_hand_angles *n, const double *v, double cj)
{
    by_hand_mass b = by_hand_mass_at(n);
    double k2 = 2 * K2 * n->s1, k4 = 2 * K4 * n->c3, k6 = 2 * K6 * n->c5, *entry = &b.m00;
    for (size_t k = 0; k < sizeof b / sizeof *entry; k++)
        entry[k] *= cj;
    double m01 = b.m10 + k2 * (v[0] + v[1]), m34 = b.m43 - k4 * v[4], m56 = b.m65 + k6 * v[6];
    b.m00 += k2 * v[1];
    b.m10 -= k2 * v[0];
    b.m43 += k4 * (v[3] + v[4]);
    b.m44 += k4 * v[3];
    b.m65 -= k6 * (v[5] + v[6]);
    b.m66 -= k6 * v[5];
    by_hand_put_blocks(m, &b, m01, m34, m56, BY_HAND_N, BY_HAND_N);
}

/* dF/dy + cj dF/dy' into m->value. */
static inline void by_hand_jacobian(by_hand_form form, double gain, double cj, const double *y, const double *yp,
                                    by_hand_matrix *m)
{
    enum { V = BY_HAND_N, L = 2 * BY_HAND_N, MU = L + BY_HAND_M };
    const double *v = y + V, *a = yp + V, *lambda = (form == BY_HAND_STABILIZED1 ? yp : y) + L;
    double by_multipliers = form == BY_HAND_STABILIZED1 ? cj : 1;
    by_hand_angles at = by_hand_look(y);
    by_hand_g g = by_hand_g_at(&at), turned = by_hand_turn(&at, v);
    int last = by_hand_has_mu(form) ? MU : L;
    m->next = 0;
    for (int i = 0; i < BY_HAND_N; i++) {
        if (!by_hand_has_mu(form))
            by_hand_put(m, i, i, cj);
        by_hand_put(m, i, V + i, -1);
    }
    by_hand_put_stiffness(m, &at, v, a, lambda);
    by_hand_put_damping(m, &at, v, cj);
    by_hand_put_g(m, &g, by_multipliers, V, L, true);
    if (by_hand_has_mu(form)) {
        by_hand_mass h = by_hand_curvature(&at, lambda + BY_HAND_M);
        double m01 = h.m10, m34 = h.m43, m56 = h.m65;
        h.m00 += cj, h.m11 += cj, h.m22 += cj, h.m33 += cj, h.m44 += cj, h.m55 += cj, h.m66 += cj;
        by_hand_put_blocks(m, &h, m01, m34, m56, 0, 0);
        by_hand_put_g(m, &g, by_multipliers, 0, MU, true);
        by_hand_put_g(m, &g, 1, L, 0, false);
    }
    if (form == BY_HAND_INDEX1) {
        by_hand_g by_q = by_hand_sum(by_hand_turn_gamma(&at, v), 1, by_hand_turn(&at, a));
        by_q = by_hand_sum(by_hand_sum(by_q, 2 * gain, turned), gain * gain, g);
        by_hand_put_g(m, &by_q, 1, L, 0, false);
        by_q = by_hand_sum((by_hand_g){0}, 2, turned);
        by_q = by_hand_sum(by_q, 2 * gain + cj, g);
        by_hand_put_g(m, &by_q, 1, L, V, false);
        return;
    }
    by_hand_put_g(m, &turned, 1, last, 0, false);
    by_hand_put_g(m, &g, 1, last, V, false);
}

#endif
