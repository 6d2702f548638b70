/* SPDX-License-Identifier: BSD-3-Clause */
/* An integrator of a user for generated equations with states that change at samples and events:
 *
 *     kempe generate tests/models/sampled_slide.yaml --lang c --sets M_C,discrete -o folder
 *     cc -std=c99 -Ifolder sampled_loop.c folder/sampled_slide.c -lm
 *
 * Runge-Kutta steps of order 4 end at samples. A state of an event changes at the end of the step in which its
 * condition begins to hold. Prints time, place and rate at the end, and the states. */
#include "sampled_slide.h"
#include <math.h>
#include <stdio.h>
#include <string.h>

enum { N = sampled_slide_coordinates, LAST = sampled_slide_discrete_states };

typedef struct motion {
    double t, q[N], qd[N];
} motion;

/* The mass matrix of this model is diagonal: the slide, and a unit for each state. */
static void accelerate(const motion *x, double qdd[N])
{
    double M[N * N], C[N];
    sampled_slide_M_C(x->t, x->q, x->qd, M, C);
    for (int k = 0; k < N; k++)
        qdd[k] = -C[k] / M[k * N + k];
}

static motion step(const motion *from, double size)
{
    static const double part[4] = {0, 0.5, 0.5, 1}, weight[4] = {1 / 6.0, 1 / 3.0, 1 / 3.0, 1 / 6.0};
    motion to = *from, at = *from;
    double v[N], a[N];
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

/* Samples are due after every `steps` steps; events where their condition has begun to hold. */
static void change(motion *x, long steps, double size, double held[LAST])
{
    double next[LAST], when[LAST];
    sampled_slide_discrete(x->t, x->q, x->qd, next, when);
    for (int k = 0; k < LAST; k++) {
        double every = sampled_slide_sample_times[k];
        int due = isfinite(every) ? steps % lround(every / size) == 0 : when[k] > held[k];
        if (due)
            x->qd[sampled_slide_discrete_places[k]] = next[k];
        held[k] = when[k];
    }
}

int main(void)
{
    const double size = 1e-3;
    double held[LAST] = {0};
    motion x = {.q = {0.1}};
    for (long steps = 0; steps < 2030; steps++) {
        change(&x, steps, size, held);
        x = step(&x, size);
    }
    printf("%.17g %.17g %.17g", x.t, x.q[0], x.qd[0]);
    for (int k = 0; k < LAST; k++)
        printf(" %.17g", x.qd[sampled_slide_discrete_places[k]]);
    printf("\n");
    return 0;
}
