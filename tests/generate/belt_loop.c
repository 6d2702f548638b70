/* SPDX-License-Identifier: BSD-3-Clause */
/* An integrator of a user for generated equations with friction that sticks, which needs nothing of Kempe:
 *
 *     kempe generate tests/models/friction_belt.yaml --lang c --drives --sets M_C+h_J+jdqd,friction -o folder
 *     cc -std=c99 -Ifolder belt_loop.c folder/friction_belt.c -lm
 *
 * It takes Runge-Kutta steps of order 4. When slip ends (its rate changes sign) or stick ends (the friction exceeds its
 * bound), it bisects the step, and decides on the next mode. Prints time, place and mode of each change. */
#include "friction_belt.h"
#include <math.h>
#include <stdio.h>
#include <string.h>

enum { N = friction_belt_coordinates, ROWS = friction_belt_rows, ALL = N + ROWS, LAST = friction_belt_frictions };

#include "../elimination.h"
#include "runge_kutta_step.h"

/* Four an element: sense of slip, 1 while it sticks, its place then, a given force. */
static double modes[4 * LAST];
static double lambda[ROWS];

/* -- equations ----------------------------------------------------------------------------------------- */

/* M qdd - J' lambda = -C, J qdd = -jdqd. The row of an element that slips is zero: its multiplier is zero then. */
static void accelerate(const motion *x, double qdd[N])
{
    double M[N * N], C[N], h[ROWS], J[ROWS * N], jdqd[ROWS], a[ALL][ALL], b[ALL];
    friction_belt_M_C_h_J_jdqd(x->t, x->q, x->qd, modes, M, C, h, J, jdqd);
    memset(a, 0, sizeof a);
    for (int i = 0; i < N; i++) {
        for (int k = 0; k < N; k++)
            a[i][k] = M[i * N + k];
        b[i] = -C[i];
    }
    for (int r = 0; r < ROWS; r++) {
        for (int k = 0; k < N; k++) {
            a[N + r][k] = J[r * N + k];
            a[k][N + r] = -J[r * N + k];
        }
        b[N + r] = -jdqd[r];
    }
    for (int e = 0; e < LAST; e++) {
        int r = N + friction_belt_friction_rows[e];
        a[r][r] = modes[4 * e + 1] > 0 ? 0 : 1;
    }
    eliminate(a, b);
    memcpy(qdd, b, N * sizeof *b);
    memcpy(lambda, b + N, sizeof lambda);
}

/* -- modes --------------------------------------------------------------------------------------------- */

static double slip[LAST], level[LAST], holding[LAST], rub[LAST];

/* Negative where the element has to change its mode. */
static double left(const motion *x, int e)
{
    double qdd[N];
    accelerate(x, qdd);
    friction_belt_friction(x->t, x->q, x->qd, lambda, modes, slip, level, holding, rub);
    return modes[4 * e + 1] > 0 ? holding[e] - fabs(rub[e]) : modes[4 * e] * slip[e];
}

/* At the end of slip it sticks, if its bound is enough; at the end of stick, or if it is not, it slips as it is pushed.
 */
static void change(const motion *x, int e)
{
    double *mode = modes + 4 * e;
    int slipped = mode[1] < 1;
    mode[0] = 0;
    mode[1] = 1;
    mode[2] = x->q[1]; /* the element's coordinate, s */
    if (left(x, e) <= 0 || !slipped) {
        mode[0] = rub[e] > 0 ? -1 : 1;
        mode[1] = 0;
    }
    printf("%.17g %.17g %d\n", x->t, x->q[0] + x->q[1], (int)mode[0]);
}

int main(void)
{
    const double size = 1e-3, end = 50;
    motion x = {.qd = {0.2, -0.2}}; /* the belt runs, the block stands */
    modes[0] = -1;
    while (x.t < end) {
        motion next = step(&x, size);
        if (left(&next, 0) >= 0) {
            x = next;
            continue;
        }
        double low = 0, high = size;
        while (high - low > 1e-15) {
            double middle = (low + high) / 2;
            next = step(&x, middle);
            *(left(&next, 0) < 0 ? &high : &low) = middle;
        }
        x = step(&x, high);
        change(&x, 0);
    }
    return 0;
}
