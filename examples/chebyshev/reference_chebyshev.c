// SPDX-License-Identifier: BSD-3-Clause
// The linkage in closed form, in 113-bit arithmetic: the circles of coupler and rocker meet.
//
//     reference_chebyshev > reference.csv
#include "../references/circles.h"

int main(void)
{
    printf(
        "# Closed form in 113-bit arithmetic, by reference_chebyshev.c: circles of coupler and rocker intersected.\n");
    printf("t,q.crank,q.coupler,q.rocker\n");
    for (int t = 0; t <= 8; t++) {
        quad crank = M_PI_2q + M_PI_4q * t;
        point a = cexpiq(crank), b = meet(a, 2.5Q, 2, 2.5Q);
        row(t, 3, (const quad[]){crank, cargq(b - a) - crank, cargq(b - 2)}, 16);
    }
    return 0;
}
