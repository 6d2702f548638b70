// SPDX-License-Identifier: BSD-3-Clause
// The leg in closed form, in 113-bit arithmetic: circles meet one after the other, and each body's angle is that of a
// bar.
//
//     reference_jansen_leg > reference.csv
#include "../references/circles.h"

// Third corner of a triangle over the side from 0 to `base`.
static point corner(quad base, quad from_start, quad from_end)
{
    return meet(0, from_start, base, from_end);
}

int main(void)
{
    const quad a = 38, b = 41.5Q, c = 39.3Q, d = 40.1Q, e = 55.8Q, f = 39.4Q, g = 36.7Q, h = 65.7Q, i = 49, j = 50,
               k = 61.9Q, l = 7.8Q, m = 15;
    printf(
        "# Closed form in 113-bit arithmetic, by reference_jansen_leg.c: circles intersected one after the other.\n");
    printf("t,q.crank,q.upper_rod,q.lower_rod,q.upper,q.link,q.lower,q.leg\n");
    for (int n = 0; n <= 8; n++) {
        quad crank = M_PI_4q * n;
        point pin = point_at(a, l) + m * cexpiq(crank);
        point u = meet(0, b, pin, j), w = u / b * corner(b, d, e);
        point below = meet(pin, k, 0, c), knee = meet(below, g, w, f);
        quad upper = cargq(u), lower = cargq(below), leg = cargq(knee - below);
        if (leg < 0)
            leg += 2 * M_PIq;
        row(0.5Q * n, 7,
            (const quad[]){crank, cargq(u - pin) - crank, cargq(below - pin) - crank, upper, cargq(knee - w) - upper,
                           lower, leg - lower},
            16);
        point foot = below + (knee - below) / g * corner(g, i, h);
        if (n % 2 == 0)
            fprintf(stderr, "foot at %g s: %.4f %.4f\n", n / 2.0, (double)crealq(foot), (double)cimagq(foot));
    }
    return 0;
}
