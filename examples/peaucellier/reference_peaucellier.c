// SPDX-License-Identifier: BSD-3-Clause
// The linkage in closed form, in 113-bit arithmetic: C is seen from O at half the crank's angle, and OC OD = L^2 - r^2.
//
//     reference_peaucellier > reference.csv
#include "../references/circles.h"

int main(void)
{
    const quad arm = 1, side = 0.4Q, crank = 0.35Q;
    printf("# Closed form in 113-bit arithmetic, by reference_peaucellier.c: OC OD = L^2 - r^2 along the ray at half "
           "the crank's "
           "angle.\n");
    printf("t,q.crank,q.arm_a,q.arm_b,q.ac,q.ad,q.bc,q.bd\n");
    for (int k = 0; k <= 10; k++) {
        quad t = 0.4Q * k, angle = degrees(60) * sinq(M_PI_2q * t);
        quad near = 2 * crank * cosq(angle / 2), far = (arm * arm - side * side) / near;
        quad middle = (near + far) / 2, height = sqrtq(arm * arm - middle * middle);
        quad up = atan2q(height, middle); // of the arm to A, from the ray
        quad to_c = atan2q(-height, near - middle) - up, to_d = atan2q(-height, far - middle) - up;
        row(t, 7, (const quad[]){angle, angle / 2 + up, angle / 2 - up, to_c, to_d, -to_c, -to_d}, 16);
    }
    return 0;
}
