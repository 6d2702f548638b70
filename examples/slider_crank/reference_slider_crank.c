// SPDX-License-Identifier: BSD-3-Clause
// The slider-crank by Kane's equations in 113-bit arithmetic (../references/kane.h), crank, rod and slider as
// coordinates. The mechanism with spatial hinges has the same motion.
//
//     reference_slider_crank > reference.csv
//     reference_slider_crank > ../slider_crank_spatial/reference.csv
#include "../references/kane.h"

static const quad R = 0.2Q, L = 0.5Q;
static const vec X = {1, 0, 0}, Z = {0, 0, 1};

static void move(quad t, const quad *q, const quad *qd, const quad *qdd, motion *m)
{
    (void)t;
    frame crank = turn(ground(), Z, q[0], qd[0], qdd[0]);
    frame rod = turn(at(crank, (vec){R, 0, 0}), Z, q[1], qd[1], qdd[1]);
    frame slider = slide(at(ground(), (vec){R + L, 0, 0}), X, q[2], qd[2], qdd[2]);
    m->bodies[0] = (body){.frame = at(crank, (vec){R / 2, 0, 0}), .mass = 1, .inertia = {0, 0, R * R / 12}};
    m->bodies[1] = (body){.frame = at(rod, (vec){L / 2, 0, 0}), .mass = 2, .inertia = {0, 0, 2 * L * L / 12}};
    m->bodies[2] = (body){.frame = slider, .mass = 3};
    frame end = at(rod, (vec){L, 0, 0});
    close_at(m, &end, &slider, 0, 1);
}

static const mechanism SYSTEM = {.n = 3, .bodies = 3, .rows = 2, .gravity = {0, -9.81Q, 0}, .move = move};

static void rates(quad t, const quad *state, quad *rate)
{
    motion_rates(&SYSTEM, t, state, rate);
}

int main(int argc, char **argv)
{
    const quad times[] = {0, 0.5Q, 1, 2, 5, 10};
    quad h = 1e-3Q, state[6] = {0, 0, 0, 5};
    close_gaps(&SYSTEM, 0, state, state + 3, (const int[]){1, 2});
    printf("# Kane's equations of crank, rod and slider in 113-bit arithmetic, by reference_slider_crank.c; two "
           "tolerances agree on "
           "all digits.\n");
    printf("t,q.crank,qd.crank,q.rod,q.slider,qd.slider\n");
    for (int k = 1; k < 6; k++) {
        integrate(rates, times[k - 1], times[k], tolerance(argc, argv), &h, 6, state);
        row(times[k], 5, (const quad[]){state[0], state[3], state[1], state[2], state[5]}, 18);
    }
    return 0;
}
