// SPDX-License-Identifier: BSD-3-Clause
// Bricard's six-bar by Kane's equation of its one degree of freedom, in 113-bit arithmetic (../references/kane.h): j1 =
// j3 = j5 and j2 = j4 with sin j1 + sin j2 + sin j1 sin j2 = 0, so that no closure is left.
//
//     reference_bricard > reference.csv
#include "../references/kane.h"

static const vec X = {1, 0, 0}, Y = {0, 1, 0}, Z = {0, 0, 1};

// j2 by j1, with rate and acceleration: a j1' + b j2' = 0.
static void other(quad j, quad jd, quad jdd, quad *k, quad *kd, quad *kdd)
{
    *k = -asinq(sinq(j) / (1 + sinq(j)));
    quad a = cosq(j) * (1 + sinq(*k)), b = cosq(*k) * (1 + sinq(j));
    *kd = -a / b * jd;
    quad ad = -sinq(j) * jd * (1 + sinq(*k)) + cosq(j) * cosq(*k) * *kd;
    quad bd = -sinq(*k) * *kd * (1 + sinq(j)) + cosq(*k) * cosq(j) * jd;
    *kdd = -(a * jdd + ad * jd + bd * *kd) / b;
}

static void move(quad t, const quad *q, const quad *qd, const quad *qdd, motion *m)
{
    (void)t;
    const vec axes[] = {Y, Z, X, Y, Z}, ways[] = {{1, 0, 0}, {0, -1, 0}, {0, 0, 1}, {-1, 0, 0}, {0, 1, 0}};
    const quad along_it = 1 / 600.Q, across = 1.01Q / 12;
    quad j[2][3] = {{q[0], qd[0], qdd[0]}};
    other(q[0], qd[0], qdd[0], &j[1][0], &j[1][1], &j[1][2]);
    frame f = ground();
    for (int k = 0; k < 5; k++) {
        f = turn(f, axes[k], j[k % 2][0], j[k % 2][1], j[k % 2][2]);
        vec w = ways[k];
        m->bodies[k] = (body){
            .frame = at(f, times(0.5Q, w)),
            .mass = 1,
            .inertia = {w.x != 0 ? along_it : across, w.y != 0 ? along_it : across, w.z != 0 ? along_it : across}};
        f = at(f, w);
    }
}

static const mechanism SYSTEM = {.n = 1, .bodies = 5, .gravity = {0, -9.81Q, 0}, .move = move};

static void rates(quad t, const quad *state, quad *rate)
{
    motion_rates(&SYSTEM, t, state, rate);
}

int main(int argc, char **argv)
{
    const quad times[] = {0, 0.5Q, 1, 2, 3, 4, 5, 6, 7, 8, 9, 9.99Q, 10};
    quad h = 1e-3Q, state[2] = {0, 0}, ignored[2];
    printf("# IFToMM A04: Kane's equation of j1 and the closed form of the others in 113-bit arithmetic, by "
           "reference_bricard.c.\n");
    printf("t,q.j1,q.j2,q.j3,q.j4,q.j5\n");
    for (int k = 1; k < 13; k++) {
        integrate(rates, times[k - 1], times[k], tolerance(argc, argv), &h, 2, state);
        quad j = state[0], o;
        other(j, 0, 0, &o, &ignored[0], &ignored[1]);
        row(times[k], 5, (const quad[]){j, o, j, o, j}, 15);
    }
    return 0;
}
