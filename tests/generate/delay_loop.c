/* SPDX-License-Identifier: BSD-3-Clause */
/* An integrator of a user for generated equations with continuous delays, which needs nothing of Kempe; of a model with
 * the name machine:
 *
 *     kempe generate machine.yaml --lang c --drives --sets M_C+h_J+jdqd,delay -o folder
 *     cc -std=c99 -Ifolder delay_loop.c folder/machine.c -lm
 *     a.out STEPS END Q.. QD..
 *
 * Runge-Kutta steps of order 4, of which each delay has a whole number. The signals at the ends of steps are kept;
 * between them they are polynomials of degree 5, of which none extends over a multiple of the delay: derivatives may
 * jump there. Prints q and qd at the end. */
#include "machine.h"
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

enum { N = machine_coordinates, ROWS = machine_rows, ALL = N + ROWS, LAST = machine_delays, DEGREE = 5 };

#include "../elimination.h"
#include "runge_kutta_step.h"

static double size, *kept[LAST]; /* signals at the ends of steps */
static int now, lag[LAST];       /* number of the step; delays in steps */

/* -- past ---------------------------------------------------------------------------------------------- */

/* The signal of delay d after so many steps, by those from number `first` on. */
static double between(int d, int first, double steps)
{
    double sum = 0;
    for (int i = first; i <= first + DEGREE; i++) {
        double weight = 1;
        for (int j = first; j <= first + DEGREE; j++)
            weight *= j == i ? 1 : (steps - j) / (i - j);
        sum += weight * kept[d][i];
    }
    return sum;
}

/* The signal that delay d has after so many steps, within the present one. */
static double late(int d, double steps)
{
    double at = steps - lag[d], signal[LAST], before[LAST], delay[LAST];
    const double none[N] = {0};
    int begin = now - lag[d], middle = (int)floor(at);
    if (begin < 0 && !machine_delay_given[d])
        return kept[d][0];
    if (begin < 0) {
        machine_delay(at * size, none, none, signal, before, delay);
        return before[d];
    }
    int low = begin / lag[d] * lag[d], first = middle - DEGREE / 2;
    first = first < low ? low : first > low + lag[d] - DEGREE ? low + lag[d] - DEGREE : first;
    return between(d, first, at);
}

/* qd with the delays at time t. */
static void set_delays(double t, double qd[N])
{
    for (int d = 0; d < LAST; d++)
        qd[machine_delay_places[d]] = late(d, t / size);
}

static void keep(const motion *x, int number)
{
    double signal[LAST], before[LAST], delay[LAST];
    machine_delay(x->t, x->q, x->qd, signal, before, delay);
    for (int d = 0; d < LAST; d++)
        kept[d][number] = signal[d];
}

/* -- motion -------------------------------------------------------------------------------------------- */

/* M qdd + C = J' lambda, J qdd + jdqd = 0. */
static void accelerate(const motion *x, double qdd[N])
{
    double M[N * N], C[N], h[ROWS], J[ROWS * N], jdqd[ROWS], a[ALL][ALL], b[ALL], qd[N];
    memcpy(qd, x->qd, sizeof qd);
    set_delays(x->t, qd);
    machine_M_C_h_J_jdqd(x->t, x->q, qd, M, C, h, J, jdqd);
    memset(a, 0, sizeof a);
    for (int i = 0; i < N; i++) {
        for (int k = 0; k < N; k++)
            a[i][k] = M[i * N + k];
        for (int r = 0; r < ROWS; r++)
            a[i][N + r] = a[N + r][i] = J[r * N + i];
        b[i] = -C[i];
    }
    for (int r = 0; r < ROWS; r++)
        b[N + r] = -jdqd[r];
    eliminate(a, b);
    memcpy(qdd, b, N * sizeof *qdd);
}

int main(int argc, char **argv)
{
    motion x = {0};
    double signal[LAST], before[LAST], delay[LAST];
    if (argc != 3 + 2 * N)
        return 2;
    int steps = atoi(argv[1]);
    size = atof(argv[2]) / steps;
    for (int k = 0; k < N; k++) {
        x.q[k] = atof(argv[3 + k]);
        x.qd[k] = atof(argv[3 + N + k]);
    }
    machine_delay(0, x.q, x.qd, signal, before, delay);
    for (int d = 0; d < LAST; d++) {
        lag[d] = (int)lround(delay[d] / size);
        kept[d] = malloc(((size_t)steps + 1) * sizeof **kept);
        if (!kept[d] || lag[d] <= DEGREE || fabs(lag[d] * size - delay[d]) > 1e-12)
            return 2;
    }
    keep(&x, 0);
    for (now = 0; now < steps; now++) {
        x = step(&x, size);
        x.t = (now + 1) * size;
        set_delays(x.t, x.qd);
        keep(&x, now + 1);
    }
    for (int k = 0; k < N; k++)
        printf("%.17g %.17g\n", x.q[k], x.qd[k]);
    for (int d = 0; d < LAST; d++)
        free(kept[d]);
    return 0;
}
