// SPDX-License-Identifier: BSD-3-Clause
// Cart and pole under sampled control, from equations of its own in 113-bit arithmetic: Lagrange's equations in x and
// the angle of the pole, integrated from sample to sample by extrapolation. The times of the samples are multiples of
// nothing.
//
//     reference_cart_pole > controlled.csv
#include "../references/quad.h"

static const quad M = 1.5Q, m = 0.3Q, l = 0.4Q, inertia = 0.016Q, g = 9.81Q; // inertia: about the pole's centre of mass
static quad force;

// (M + m) x'' - m l (cos(phi) phi'' - sin(phi) phi'^2) = u;  (inertia + m l^2) phi'' = m l (cos(phi) x'' + g sin(phi))
static void rates(quad t, const quad *state, quad *rate)
{
    quad s = sinq(state[1]), c = cosq(state[1]);
    quad a[4] = {M + m, -m * l * c, -m * l * c, inertia + m * l * l};
    (void)t;
    rate[0] = state[2];
    rate[1] = state[3];
    rate[2] = force - m * l * s * squared(state[3]);
    rate[3] = m * l * g * s;
    solve(2, a, rate + 2);
}

// A proportional and derivative law in both coordinates.
static quad controlled(const quad *state)
{
    return 4 * state[0] - 70 * state[1] + 8 * state[2] - 16 * state[3];
}

int main(int argc, char **argv)
{
    quad state[5] = {0, 0.6Q}, t = 0, h = 1e-3Q;
    printf(
        "# Lagrange's equations between samples by extrapolation in 113-bit arithmetic, by reference_cart_pole.c.\n");
    printf("t,q.x,q.phi,qd.x,qd.phi,u\n");
    for (int k = 1; k <= 150; k++) {
        quad next = (200 * k + 37 * k * k % 97) / 10000.Q;
        force = state[4] = controlled(state);
        row(t, 5, state, 17);
        integrate(rates, t, next, tolerance(argc, argv), &h, 4, state);
        t = next;
    }
    state[4] = controlled(state);
    row(t, 5, state, 17);
    return 0;
}
