// SPDX-License-Identifier: BSD-3-Clause
// The governor by Lagrange's equations in 113-bit arithmetic. Both rods move alike: coordinates are the shaft's angle,
// the height of the slider and the rods' angle below the horizontal. Steps short enough for an explicit method: the
// fastest motion decays with 1e4 1/s.
//
//     reference_governor > reference.csv
#include "../references/quad.h"

static const quad K = 8e5Q, C = 4e4Q, W = 0.01Q, B = 0.05Q, BALL = 5, BAR = 0.3Q, G = 9.81Q;
static quad LEVER, ROD, ACROSS, AXIAL,
    SHAFT; // centre and mass of a rod with its ball, its inertia; inertia of shaft and slider

static void prepare(void)
{
    ROD = BAR + BALL;
    LEVER = (BAR / 2 + BALL) / ROD;
    ACROSS = BAR * (1 + W * W) / 12 + BAR * squared(LEVER - 0.5Q) + BALL * squared(1 - LEVER);
    AXIAL = BAR * W * W / 6;
    SHAFT = 0.3Q * W * W / 6 + 3 * 0.01Q / 6;
}

// Inertia about the shaft, and its derivative by the rods' angle.
static quad about_shaft(quad angle, quad *slope)
{
    quad radius = B + LEVER * cosq(angle);
    *slope = 2 * (-2 * ROD * radius * LEVER * sinq(angle) + 2 * (AXIAL - ACROSS) * sinq(angle) * cosq(angle));
    return SHAFT + 2 * (ROD * squared(radius) + AXIAL * squared(sinq(angle)) + ACROSS * squared(cosq(angle)));
}

// State: shaft, slider, rod, and their rates.
static void rates(quad t, const quad *s, quad *rate)
{
    (void)t;
    quad c = cosq(s[2]), n = sinq(s[2]), slope, inertia = about_shaft(s[2], &slope);
    // the spring from the middle of a rod to the slider
    quad x = 0.5Q * c, y = 1 - 0.5Q * n - s[1], length = sqrtq(x * x + y * y);
    quad by_rod = (-x * 0.5Q * n - y * 0.5Q * c) / length, by_slider = -y / length;
    quad force = K * (length - 0.5Q) + C * (by_rod * s[5] + by_slider * s[4]);
    memcpy(rate, s + 3, 3 * sizeof *rate);
    rate[3] = -slope * s[5] * s[3] / inertia;
    rate[4] = -2 * force * by_slider / 3 - G;
    rate[5] = (slope * s[3] * s[3] / 4 + ROD * G * LEVER * c - force * by_rod) / (ROD * LEVER * LEVER + ACROSS);
}

int main(int argc, char **argv)
{
    const quad times[] = {0, 0.1Q, 0.5Q, 1, 2, 3, 4, 5, 6, 7, 8, 9, 10};
    quad h = 1e-3Q, state[6] = {0, 0.5Q, M_PIq / 6, 2 * M_PIq, 0, 0};
    prepare();
    printf("# IFToMM A05: Lagrange's equations in 113-bit arithmetic, by reference_governor.c; two tolerances agree on "
           "all "
           "digits.\n");
    printf("t,q.shaft,qd.shaft,q.slider,q.right,q.left\n");
    for (int k = 1; k < 13; k++) {
        integrate(rates, times[k - 1], times[k], tolerance(argc, argv), &h, 6, state);
        row(times[k], 5, (const quad[]){state[0], state[3], state[1], state[2], state[2]}, 18);
    }
    return 0;
}
