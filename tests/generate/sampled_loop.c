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

#include "runge_kutta_step.h"

/* The mass matrix of this model is diagonal: the slide, and a unit for each state. */
static void accelerate(const motion *x, double qdd[N])
{
    double M[N * N], C[N];
    sampled_slide_M_C(x->t, x->q, x->qd, M, C);
    for (int k = 0; k < N; k++)
        qdd[k] = -C[k] / M[k * N + k];
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
