/* SPDX-License-Identifier: BSD-3-Clause */
/* A planar four-bar by hand, to judge Kempe's by: absolute angles, the five equations of motion and constraint of the
 * textbooks in long double, Gauss with complete pivoting, Runge-Kutta of order 6, projection after each step. Steps
 * shrink with the smallest pivot, so that positions near a change point are resolved. */
#ifndef KEMPE_BENCH_FOUR_BAR_BY_HAND_H
#define KEMPE_BENCH_FOUR_BAR_BY_HAND_H

#include <math.h>
#include <stdbool.h>

/* Crank, coupler, rocker: length, distance of the centre of mass from the first joint, mass, inertia about the centre.
 * The crank turns about (0, 0), the rocker about (base, 0); gravity 9.81 downwards. */
typedef struct by_hand {
    long double length[3], com[3], mass[3], inertia[3], base;
    long double q[3], qd[3]; /* angles from +x */
} by_hand;

/* Gauss with complete pivoting of an m x m system; returns the last pivot over the first. */
static long double by_hand_solve(int m, long double a[5][5], long double *b)
{
    int column[5];
    long double x[5], first = 0, last = 0;
    for (int k = 0; k < m; k++)
        column[k] = k;
    for (int k = 0; k < m; k++) {
        int pr = k, pc = k;
        for (int i = k; i < m; i++)
            for (int j = k; j < m; j++)
                if (fabsl(a[i][j]) > fabsl(a[pr][pc])) {
                    pr = i;
                    pc = j;
                }
        for (int j = 0; j < m; j++) {
            long double t = a[k][j];
            a[k][j] = a[pr][j];
            a[pr][j] = t;
        }
        long double t = b[k];
        b[k] = b[pr];
        b[pr] = t;
        for (int i = 0; i < m; i++) {
            long double s = a[i][k];
            a[i][k] = a[i][pc];
            a[i][pc] = s;
        }
        int c = column[k];
        column[k] = column[pc];
        column[pc] = c;
        last = fabsl(a[k][k]);
        first = k ? first : last;
        for (int i = k + 1; i < m; i++) {
            long double f = a[i][k] / a[k][k];
            for (int j = k; j < m; j++)
                a[i][j] -= f * a[k][j];
            b[i] -= f * b[k];
        }
    }
    for (int k = m - 1; k >= 0; k--) {
        for (int j = k + 1; j < m; j++)
            b[k] -= a[k][j] * b[j];
        b[k] /= a[k][k];
    }
    for (int k = 0; k < m; k++)
        x[column[k]] = b[k];
    for (int k = 0; k < m; k++)
        b[k] = x[k];
    return last / first;
}

/* h = crank + coupler - rocker - (base, 0), its Jacobian, and the centripetal part of its second derivative. */
static void by_hand_closure(const by_hand *f, const long double *q, const long double *qd, long double h[2],
                            long double j[2][3], long double bend[2])
{
    h[0] = -f->base;
    h[1] = bend[0] = bend[1] = 0;
    for (int k = 0; k < 3; k++) {
        long double l = k == 2 ? -f->length[k] : f->length[k], c = l * cosl(q[k]), s = l * sinl(q[k]);
        h[0] += c;
        h[1] += s;
        j[0][k] = -s;
        j[1][k] = c;
        bend[0] -= c * qd[k] * qd[k];
        bend[1] -= s * qd[k] * qd[k];
    }
}

/* Mass matrix and generalised forces. The coupler's centre is at crank + com: its angle couples with the crank's. */
static void by_hand_motion(const by_hand *f, const long double *q, const long double *qd, long double m[3][3],
                           long double force[3])
{
    const long double g = 9.81L;
    long double l = f->length[0], s = f->com[1] * f->mass[1], d = q[1] - q[0];
    for (int i = 0; i < 3; i++)
        for (int k = 0; k < 3; k++)
            m[i][k] = i == k ? f->inertia[i] + f->mass[i] * f->com[i] * f->com[i] : 0;
    m[0][0] += f->mass[1] * l * l;
    m[0][1] = m[1][0] = s * l * cosl(d);
    force[0] = s * l * sinl(d) * qd[1] * qd[1] - g * (f->mass[0] * f->com[0] + f->mass[1] * l) * cosl(q[0]);
    force[1] = -s * l * sinl(d) * qd[0] * qd[0] - g * s * cosl(q[1]);
    force[2] = -g * f->mass[2] * f->com[2] * cosl(q[2]);
}

/* Solves M x - J' y = top, J x = bottom; returns the least pivot. */
static long double by_hand_saddle(const by_hand *f, const long double *q, const long double *qd, const long double *top,
                                  const long double *bottom, long double x[3])
{
    long double h[2], j[2][3], bend[2], m[3][3], force[3], a[5][5] = {{0}}, b[5];
    by_hand_closure(f, q, qd, h, j, bend);
    by_hand_motion(f, q, qd, m, force);
    for (int i = 0; i < 3; i++) {
        for (int k = 0; k < 3; k++)
            a[i][k] = m[i][k];
        for (int k = 0; k < 2; k++)
            a[i][3 + k] = a[3 + k][i] = j[k][i];
        b[i] = top ? top[i] : force[i];
    }
    for (int k = 0; k < 2; k++)
        b[3 + k] = bottom ? bottom[k] : -bend[k];
    long double pivot = by_hand_solve(5, a, b);
    for (int i = 0; i < 3; i++)
        x[i] = b[i];
    return pivot;
}

/* By passes of Newton's method, each of which squares the gap. */
static void by_hand_project(by_hand *f, int passes)
{
    const long double none[3] = {0};
    long double h[2], j[2][3], bend[2], dx[3];
    for (int pass = 0; pass < passes; pass++) {
        by_hand_closure(f, f->q, f->qd, h, j, bend);
        long double b[2] = {-h[0], -h[1]};
        (void)by_hand_saddle(f, f->q, f->qd, none, b, dx);
        for (int i = 0; i < 3; i++)
            f->q[i] += dx[i];
        by_hand_closure(f, f->q, f->qd, h, j, bend);
        for (int k = 0; k < 2; k++)
            b[k] = -(j[k][0] * f->qd[0] + j[k][1] * f->qd[1] + j[k][2] * f->qd[2]);
        (void)by_hand_saddle(f, f->q, f->qd, none, b, dx);
        for (int i = 0; i < 3; i++)
            f->qd[i] += dx[i];
    }
}

/* One step of Butcher's method (On Runge-Kutta processes of high order, J. Australian Math. Soc. 4 (1964) 179), and the
 * projection of what little it leaves; returns the least pivot at its beginning. */
static long double by_hand_step(by_hand *f, long double h)
{
    enum { STAGES = 7 };
    static const long double a[STAGES + 1][STAGES] = {
        {0},
        {1.0L / 3},
        {0, 2.0L / 3},
        {1.0L / 12, 1.0L / 3, -1.0L / 12},
        {-1.0L / 16, 9.0L / 8, -3.0L / 16, -3.0L / 8},
        {0, 9.0L / 8, -3.0L / 8, -3.0L / 4, 1.0L / 2},
        {9.0L / 44, -9.0L / 11, 63.0L / 44, 18.0L / 11, 0, -16.0L / 11},
        {11.0L / 120, 0, 27.0L / 40, 27.0L / 40, -4.0L / 15, -4.0L / 15, 11.0L / 120}};
    long double q[3], qd[3], kq[STAGES][3], kv[STAGES][3], pivot = 1;
    for (int stage = 0; stage <= STAGES; stage++) {
        for (int i = 0; i < 3; i++) {
            q[i] = f->q[i];
            qd[i] = f->qd[i];
            for (int k = 0; k < stage; k++) {
                q[i] += h * a[stage][k] * kq[k][i];
                qd[i] += h * a[stage][k] * kv[k][i];
            }
        }
        if (stage == STAGES)
            break;
        long double least = by_hand_saddle(f, q, qd, 0, 0, kv[stage]);
        pivot = stage ? pivot : least;
        for (int i = 0; i < 3; i++)
            kq[stage][i] = qd[i];
    }
    for (int i = 0; i < 3; i++) {
        f->q[i] = q[i];
        f->qd[i] = qd[i];
    }
    by_hand_project(f, 1);
    return pivot;
}

/* From its start for a time, in steps of at most h. */
static void by_hand_integrate(by_hand *f, double time, double h)
{
    long double t = 0, size = h, usual = 0;
    by_hand_project(f, 3);
    while (t < time) {
        long double step = fminl(size, time - t), pivot = by_hand_step(f, step);
        usual = fmaxl(usual, pivot);
        size = h * fminl(1, 2 * sqrtl(pivot / usual)); /* the pivot falls with the square of the distance */
        t += step;
    }
}

/* Equal to rounding: formulations close the loops of a start each for itself. */
static bool by_hand_equal(const by_hand *a, const by_hand *b)
{
    const long double *x = (const long double *)a, *y = (const long double *)b;
    size_t count = sizeof *a / sizeof *x, k = 0;
    while (k < count && fabsl(x[k] - y[k]) <= 1e-14L * fmaxl(1, fabsl(x[k])))
        k++;
    return k == count;
}

/* by_hand_integrate, once for each start: several formulations are judged from the same one. */
static void by_hand_run(by_hand *f, double time, double h)
{
    static struct {
        by_hand start, end;
        double time, h;
    } runs[32];
    static size_t count;
    size_t k = 0;
    while (k < count && !(by_hand_equal(&runs[k].start, f) && runs[k].time == time && runs[k].h == h))
        k++;
    if (k < count) {
        *f = runs[k].end;
        return;
    }
    by_hand start = *f;
    by_hand_integrate(f, time, h);
    if (count == sizeof runs / sizeof *runs)
        return;
    runs[count].start = start;
    runs[count].end = *f;
    runs[count].time = time;
    runs[count].h = h;
    count++;
}

#endif
