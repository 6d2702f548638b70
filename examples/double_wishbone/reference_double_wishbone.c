// SPDX-License-Identifier: BSD-3-Clause
// The suspension's positions by Newton's iteration on seven gaps, in 113-bit arithmetic: two ball joints and the tie
// rod, for given angles of the lower arm.
//
//     reference_double_wishbone > reference.csv
#include "../references/kane.h"

static const vec X = {1, 0, 0}, Y = {0, 1, 0}, Z = {0, 0, 1};

// Coordinates: upper arm, the six of the upright, lower arm.
static void move(quad t, const quad *q, const quad *qd, const quad *qdd, motion *m)
{
    (void)t;
    frame upper =
        turn(at(ground(), (vec){-0.268Q, 0.478Q, 0.196Q}), unit((vec){0.220Q, -0.032Q, 0.049Q}), q[0], qd[0], qdd[0]);
    frame lower = turn(at(ground(), (vec){-0.223Q, 0.307Q, 0}), X, q[7], qd[7], qdd[7]);
    frame upright = at(ground(), (vec){-0.040Q, 0.910Q, -0.026Q});
    const vec axes[] = {X, Y, Z, Z, X, Y};
    for (int k = 0; k < 6; k++)
        upright = (k < 3 ? slide : turn)(upright, axes[k], q[k + 1], qd[k + 1], qdd[k + 1]);
    frame u = at(upper, (vec){0.215Q, 0.238Q, 0.019Q}), l = at(lower, (vec){0.187Q, 0.480Q, -0.118Q});
    frame uu = at(upright, (vec){-0.013Q, -0.194Q, 0.241Q}), ul = at(upright, (vec){0.004Q, -0.123Q, -0.092Q});
    close_at(m, &u, &uu, 0, 2);
    close_at(m, &l, &ul, 0, 2);
    const vec tie = {-0.250Q, 0.448Q, 0.054Q}, start = minus((vec){-0.176Q, 0.821Q, -0.016Q}, tie);
    frame end = at(upright, (vec){-0.136Q, -0.089Q, 0.010Q});
    vec way = minus(end.place, tie);
    m->gap[m->rows] = (dot(way, way) - dot(start, start)) / 2;
    m->gap_rate[m->rows++] = dot(way, end.velocity);
}

static const mechanism SYSTEM = {.n = 8, .rows = 7, .move = move};

int main(void)
{
    quad q[8] = {0};
    printf("# Arm at -10, -5, 0, 5 and 10 degrees: a Newton solve in 113-bit arithmetic, by "
           "reference_double_wishbone.c.\n");
    printf("t,q.upright.1,q.upright.2,q.upright.3,q.upright.4,q.upright.5\n");
    for (int k = 0; k < 5; k++) {
        q[7] = degrees(5 * k - 10);
        close_gaps(&SYSTEM, 0, q, NULL, (const int[]){0, 1, 2, 3, 4, 5, 6});
        row(k, 5, q + 1, 15);
    }
    return 0;
}
