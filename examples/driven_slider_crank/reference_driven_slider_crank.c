// SPDX-License-Identifier: BSD-3-Clause
// The motion in closed form, in 113-bit arithmetic: a = 2 pi t, slider = r cos a + sqrt(l^2 - r^2 sin^2 a) - r - l,
// rod = -a - asin(r sin(a)/l).
//
//     reference_driven_slider_crank > reference.csv
#include "../references/quad.h"

int main(void)
{
    const quad times[] = {0.1Q, 0.25Q, 0.4Q, 0.7Q, 1.15Q, 2}, r = 0.2Q, l = 0.5Q, rate = 2 * M_PIq;
    printf("# Closed form in 113-bit arithmetic, by reference_driven_slider_crank.c: a = 2 pi t, slider = r cos a + "
           "sqrt(l^2 - r^2 sin^2 "
           "a) - r - l,\n");
    printf("# rod = -a - asin(r sin(a)/l).\n");
    printf("t,q.crank,qd.crank,q.rod,qd.rod,q.slider,qd.slider\n");
    for (int k = 0; k < 6; k++) {
        quad a = rate * times[k], level = sqrtq(l * l - squared(r * sinq(a)));
        row(times[k], 6,
            (const quad[]){a, rate, -a - asinq(r * sinq(a) / l), -rate - rate * r * cosq(a) / level,
                           r * cosq(a) + level - r - l, -rate * r * sinq(a) * (1 + r * cosq(a) / level)},
            18);
    }
    return 0;
}
