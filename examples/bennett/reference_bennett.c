// SPDX-License-Identifier: BSD-3-Clause
// The linkage in closed form, in 113-bit arithmetic: tan(j1/2) tan(j2/2) = sin((beta + alpha)/2)/sin((beta - alpha)/2),
// and its derivative.
//
//     reference_bennett > reference.csv
#include "../references/quad.h"

int main(void)
{
    const quad ratio = sinq(degrees(115) / 2) / sinq(degrees(35) / 2);
    printf("# Closed form: tan(j1/2) tan(j2/2) = sin((beta + alpha)/2)/sin((beta - alpha)/2), j3 = -j1, and its "
           "derivative; in 113-bit\n");
    printf("# arithmetic, by reference_bennett.c.\n");
    printf("t,q.j1,q.j2,q.j3,qd.j1,qd.j2,qd.j3\n");
    for (int t = 0; t <= 10; t++) {
        quad first = 1 + 2 * t, y = M_PI_2q - first / 2; // tan(j2/2) = ratio tan(y)
        quad half = atan2q(ratio * sinq(y), cosq(y));
        half += 2 * M_PIq * rintq((y - half) / (2 * M_PIq)); // of that turn
        quad rate = -2 * ratio / (squared(cosq(y)) + squared(ratio * sinq(y)));
        row(t, 6, (const quad[]){first, 2 * half, -first, 2, rate, -2}, 16);
    }
    return 0;
}
