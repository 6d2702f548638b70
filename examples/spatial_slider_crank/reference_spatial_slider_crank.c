// SPDX-License-Identifier: BSD-3-Clause
// The spatial slider-crank by Kane's equations in 113-bit arithmetic (../references/kane.h): crank, slider, both angles
// of the universal joint, three rows of the ball joint.
//
//     reference_spatial_slider_crank > reference.csv
#include "../references/kane.h"

static const quad R = 0.08Q, L = 0.3Q, AXIAL = 4e-4Q, ACROSS = 4e-3Q;
static const vec X = {1, 0, 0}, Z = {0, 0, 1};

static void move(quad t, const quad *q, const quad *qd, const quad *qdd, motion *m)
{
    (void)t;
    const vec d = {-2 / 3.Q, 1 / 3.Q, 2 / 3.Q}; // of the rod at the start
    const quad less = AXIAL - ACROSS;
    frame crank = turn(at(ground(), (vec){0, 0.1Q, 0.12Q}), X, q[0], qd[0], qdd[0]);
    frame slider = slide(ground(), X, q[1], qd[1], qdd[1]);
    frame rod = turn(slider, Z, q[2], qd[2], qdd[2]);
    rod = turn(rod, unit((vec){-1, -2, 0}), q[3], qd[3], qdd[3]);
    m->bodies[0] = (body){.frame = crank, .mass = 0.12Q, .inertia = {1e-4Q, 1e-5Q, 1e-4Q}};
    m->bodies[1] = (body){.frame = slider, .mass = 2};
    m->bodies[2] = (body){.frame = at(rod, times(L / 2, d)),
                          .mass = 0.5Q,
                          .inertia = {ACROSS + less * d.x * d.x, ACROSS + less * d.y * d.y, ACROSS + less * d.z * d.z,
                                      less * d.x * d.y, less * d.x * d.z, less * d.y * d.z}};
    frame pin = at(crank, (vec){0, 0, R}), end = at(rod, times(L, d));
    close_at(m, &pin, &end, 0, 2);
}

static const mechanism SYSTEM = {.n = 4, .bodies = 3, .rows = 3, .gravity = {0, 0, -9.81Q}, .move = move};

static void rates(quad t, const quad *state, quad *rate)
{
    motion_rates(&SYSTEM, t, state, rate);
}

int main(int argc, char **argv)
{
    const quad times[] = {0, 0.2Q, 1, 2, 5};
    quad h = 1e-3Q, state[8] = {0, 0.2Q, 0, 0, 6};
    close_gaps(&SYSTEM, 0, state, state + 4, (const int[]){1, 2, 3});
    printf("# Kane's equations in 113-bit arithmetic, by reference_spatial_slider_crank.c; two tolerances agree on all "
           "digits.\n");
    printf("t,q.slider,qd.slider,q.crank,qd.crank\n");
    for (int k = 1; k < 5; k++) {
        integrate(rates, times[k - 1], times[k], tolerance(argc, argv), &h, 8, state);
        row(times[k], 4, (const quad[]){state[1], state[5], state[0], state[4]}, 18);
    }
    return 0;
}
