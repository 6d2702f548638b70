/* SPDX-License-Identifier: BSD-3-Clause */
/* An integrator of a user for generated equations with rigid contacts, which needs nothing of Kempe; of a model with
 * the name machine:
 *
 *     kempe generate machine.yaml --lang c --drives --sets M_C+h_J+jdqd,contact,impact -o folder
 *     cc -std=c99 -Ifolder contact_loop.c folder/machine.c -lm
 *     a.out STEP Q.. QD.. TIME..
 *
 * Runge-Kutta steps of order 4 end at the times, whose states it prints, and where an open contact has no distance left
 * or a closed one no force: there it bisects. The contacts that touch strike together, by Newton's law. A contact
 * closes where its next flight would take less than 1e-6 s. */
#include "machine.h"
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

enum { N = machine_coordinates, ROWS = machine_rows, ALL = N + ROWS, LAST = machine_contacts };

#include "../elimination.h"
#include "runge_kutta_step.h"

static double modes[machine_mode_entries * machine_elements];
static double M[N * N], C[N], h[ROWS], J[ROWS * N], jdqd[ROWS];
static double gap[LAST], gap_rate[LAST], push[LAST];
static double lambda[ROWS];
static const double none[ROWS];

static int is_closed(int c)
{
    return modes[machine_contact_modes[c] + 1] > 0;
}

static void close_contact(int c, int closed)
{
    modes[machine_contact_modes[c] + 1] = closed;
    modes[machine_contact_modes[c] + 2] = 0;
}

/* -- equations ----------------------------------------------------------------------------------------- */

/* M x - J' y = first, J x = second. The row of a contact that is open is zero: its y is zero then. */
static void solve(const double *first, const double *second, double x[N], double y[ROWS])
{
    double a[ALL][ALL], b[ALL];
    memset(a, 0, sizeof a);
    for (int i = 0; i < N; i++) {
        for (int k = 0; k < N; k++)
            a[i][k] = M[i * N + k];
        b[i] = first[i];
    }
    for (int r = 0; r < ROWS; r++) {
        double size = 0;
        for (int k = 0; k < N; k++) {
            a[N + r][k] = J[r * N + k];
            a[k][N + r] = -J[r * N + k];
            size += fabs(J[r * N + k]);
        }
        a[N + r][N + r] = size > 0 ? 0 : 1;
        b[N + r] = second[r];
    }
    eliminate(a, b);
    memcpy(x, b, N * sizeof *x);
    memcpy(y, b + N, ROWS * sizeof *y);
}

static void accelerate(const motion *x, double qdd[N])
{
    machine_M_C_h_J_jdqd(x->t, x->q, x->qd, modes, M, C, h, J, jdqd);
    for (int k = 0; k < N; k++)
        C[k] = -C[k];
    for (int r = 0; r < ROWS; r++)
        jdqd[r] = -jdqd[r];
    solve(C, jdqd, qdd, lambda);
}

/* -- contacts ------------------------------------------------------------------------------------------ */

/* The least of all distances of open contacts and forces of closed ones: negative where one changes. Opens those whose
 * force is negative on request. */
static double left(const motion *x, int opens)
{
    double qdd[N], least = 1;
    accelerate(x, qdd);
    machine_contact(x->t, x->q, x->qd, lambda, modes, gap, gap_rate, push);
    for (int c = 0; c < LAST; c++) {
        least = fmin(least, is_closed(c) ? push[c] : gap[c]);
        if (opens && is_closed(c) && push[c] < 0) {
            close_contact(c, 0);
            printf("open %.17g\n", x->t);
        }
    }
    return least;
}

/* Rates after an impact of the contacts that are closed; opens the one whose impulse pulls most. False: none does. */
static int bounce(const motion *x, double given[ROWS], double rates[N])
{
    double impulse[ROWS], before[N];
    int most = -1;
    machine_M_C_h_J_jdqd(x->t, x->q, x->qd, modes, M, C, h, J, jdqd);
    machine_impact(x->t, x->q, x->qd, modes, given);
    for (int i = 0; i < N; i++) {
        before[i] = 0;
        for (int k = 0; k < N; k++)
            before[i] += M[i * N + k] * x->qd[k];
    }
    solve(before, given, rates, impulse);
    for (int c = 0; c < LAST; c++)
        if (impulse[machine_contact_rows[c]] < (most < 0 ? 0 : impulse[machine_contact_rows[most]]))
            most = c;
    if (most >= 0)
        close_contact(most, 0);
    return most >= 0;
}

/* The contacts that touch strike or stay closed; one without a flight of its own closes. */
static void strike(motion *x, double last[LAST])
{
    double before[LAST], given[ROWS], rest[ROWS], rates[N], momentum[N], impulse[ROWS];
    machine_contact(x->t, x->q, x->qd, none, modes, gap, before, push);
    for (int c = 0; c < LAST; c++)
        close_contact(c, is_closed(c) || (gap[c] < 1e-9 && before[c] < 0));
    while (bounce(x, given, rates))
        continue;
    machine_contact(x->t, x->q, rates, none, modes, gap, gap_rate, push);
    machine_impact(x->t, x->q, rates, modes, rest);
    for (int c = 0; c < LAST; c++) {
        if (!is_closed(c) || before[c] >= 0)
            continue;
        printf("impact %.17g\n", x->t);
        if (gap_rate[c] / -before[c] * (x->t - last[c]) < 1e-6) {
            given[machine_contact_rows[c]] = rest[machine_contact_rows[c]];
            printf("close %.17g\n", x->t);
        } else {
            close_contact(c, 0);
            last[c] = x->t;
        }
    }
    for (int i = 0; i < N; i++) {
        momentum[i] = 0;
        for (int k = 0; k < N; k++)
            momentum[i] += M[i * N + k] * x->qd[k];
    }
    solve(momentum, given, x->qd, impulse);
}

/* -- the motion ---------------------------------------------------------------------------------------- */

static motion go_on(const motion *from, double size, double last[LAST])
{
    motion to = step(from, size);
    double low = 0, high = size;
    if (left(&to, 0) >= 0)
        return to;
    while (high - low > 1e-15) {
        double middle = (low + high) / 2;
        to = step(from, middle);
        *(left(&to, 0) < 0 ? &high : &low) = middle;
    }
    to = step(from, high);
    (void)left(&to, 1);
    strike(&to, last);
    return to;
}

int main(int count, char **words)
{
    double last[LAST];
    motion x = {0};
    for (int c = 0; c < LAST; c++)
        last[c] = -INFINITY;
    for (int k = 0; k < N && count > 2 + N + k; k++) {
        x.q[k] = atof(words[2 + k]);
        x.qd[k] = atof(words[2 + N + k]);
    }
    for (int k = 2 + 2 * N; k < count; k++) {
        double end = atof(words[k]);
        while (end - x.t > 1e-15)
            x = go_on(&x, fmin(atof(words[1]), end - x.t), last);
        printf("state %.17g", x.t);
        for (int i = 0; i < N; i++)
            printf(" %.17g", x.q[i]);
        for (int i = 0; i < N; i++)
            printf(" %.17g", x.qd[i]);
        printf("\n");
    }
    return 0;
}
