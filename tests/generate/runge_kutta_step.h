/* SPDX-License-Identifier: BSD-3-Clause */
/* A step of the classical method of Runge and Kutta, of order 4, for loops with N coordinates and accelerations of
 * their own. To be included after N. */
#ifndef RUNGE_KUTTA_STEP_H
#define RUNGE_KUTTA_STEP_H

typedef struct motion {
    double t, q[N], qd[N];
} motion;

static void accelerate(const motion *x, double qdd[N]);

static motion step(const motion *from, double size)
{
    static const double part[4] = {0, 0.5, 0.5, 1}, weight[4] = {1 / 6.0, 1 / 3.0, 1 / 3.0, 1 / 6.0};
    motion to = *from, at = *from;
    double v[N] = {0}, a[N] = {0};
    for (int stage = 0; stage < 4; stage++) {
        at.t = from->t + part[stage] * size;
        for (int k = 0; stage > 0 && k < N; k++) {
            at.q[k] = from->q[k] + part[stage] * size * v[k];
            at.qd[k] = from->qd[k] + part[stage] * size * a[k];
        }
        accelerate(&at, a);
        for (int k = 0; k < N; k++) {
            v[k] = at.qd[k];
            to.q[k] += weight[stage] * size * v[k];
            to.qd[k] += weight[stage] * size * a[k];
        }
    }
    to.t = from->t + size;
    return to;
}

#endif
