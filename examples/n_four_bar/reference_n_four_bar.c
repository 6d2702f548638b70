// SPDX-License-Identifier: BSD-3-Clause
// The windows as the pendulum that they are, in 113-bit arithmetic: all N + 1 upright bars have one angle, the N others
// are level and move as the tips do. The windows with spatial hinges have the same motion.
//
//     reference_n_four_bar 2 > reference.csv
//     reference_n_four_bar 1 > reference_1.csv
//     reference_n_four_bar 40 > reference_40.csv
//     reference_n_four_bar 2 > ../n_four_bar_spatial/reference.csv
#include "../references/quad.h"

static quad N; // windows

// Bars of 1 m and 1 kg: (N + 1)/3 + N of inertia, (N + 1)/2 + N times g of torque.
static void rates(quad t, const quad *state, quad *rate)
{
    (void)t;
    rate[0] = state[1];
    rate[1] = -9.81Q * cosq(state[0]) * ((N + 1) / 2 + N) / ((N + 1) / 3 + N);
}

int main(int argc, char **argv)
{
    const quad times[] = {0, 0.05Q, 5, 10, 20};
    quad h = 1e-3Q, state[2] = {M_PI_2q, -1};
    N = argc > 1 ? strtoflt128(argv[1], NULL) : 2;
    printf("# IFToMM A02, N = %g: the equation of a pendulum in 113-bit arithmetic, by reference_n_four_bar.c.\n",
           (double)N);
    printf("t,q.a0,q.a%g,q.b0\n", (double)N);
    for (int k = 1; k < 5; k++) {
        integrate(rates, times[k - 1], times[k], tolerance(argc - 1, argv + 1), &h, 2, state);
        row(times[k], 3, (const quad[]){state[0], state[0], -state[0]}, 17);
    }
    return 0;
}
