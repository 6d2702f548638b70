// SPDX-License-Identifier: BSD-3-Clause
// The excavator's arm with its hydraulics, in 113-bit arithmetic: Kane's equations of four bodies with the closure of
// the link, pressures and spools beside them, integrated by extrapolation from sample to sample of the digital
// controllers.
//
//     reference_hydraulic_excavator > reference.csv
#include "../references/kane.h"

enum { BOOM, STICK, BUCKET, ROCKER, BODIES };
enum { CYLINDERS = 3, PRESSURES = 2 * BODIES, SPOOLS = PRESSURES + 2 * CYLINDERS, STATE = SPOOLS + CYLINDERS };

static const quad supply = 22e6Q, beta = 1.2e9Q, hose = 1.5e-3Q, opening = 6e-7Q, lap = 0.02Q, low = 0.2e6Q,
                  spool = 0.01Q, sample = 0.01Q;
// Length of each cylinder at which the chamber of the piston, and that of the rod, is empty.
static const quad shortest[CYLINDERS] = {1, 1, 0.8Q}, longest[CYLINDERS] = {2, 2, 1.6Q};
static quad area[2], command[CYLINDERS], integral[CYLINDERS];

// Both ends of each cylinder and their bodies, -1: the ground; its length and the rate of that.
static frame ends[CYLINDERS][2];
static const int bodies[CYLINDERS][2] = {{-1, BOOM}, {BOOM, STICK}, {STICK, ROCKER}};
static quad length[CYLINDERS], speed[CYLINDERS], thrust[CYLINDERS];

static frame hinge(const frame *parent, quad x, quad y, const quad *q, const quad *qd, const quad *qdd, int k)
{
    return turn(at(*parent, (vec){x, y, 0}), (vec){0, 0, 1}, q[k], qd[k], qdd[k]);
}

static void put(motion *m, int k, const frame *f, quad x, quad y, quad mass, quad inertia)
{
    m->bodies[k] = (body){.frame = at(*f, (vec){x, y, 0}), .mass = mass, .inertia = {0, 0, inertia}};
}

static void move(quad t, const quad *q, const quad *qd, const quad *qdd, motion *m)
{
    frame base = ground(), boom = hinge(&base, 0, 0, q, qd, qdd, BOOM),
          stick = hinge(&boom, 2.8Q, 0, q, qd, qdd, STICK), bucket = hinge(&stick, 1.5Q, 0, q, qd, qdd, BUCKET),
          rocker = hinge(&stick, 1.2Q, 0, q, qd, qdd, ROCKER);
    (void)t;
    put(m, BOOM, &boom, 1.3Q, 0.1Q, 300, 220);
    put(m, STICK, &stick, 0.5Q, 0.05Q, 150, 45);
    put(m, BUCKET, &bucket, 0.35Q, 0.15Q, 120, 15);
    put(m, ROCKER, &rocker, 0.15Q, 0, 10, 0.1Q);
    frame eye = at(rocker, (vec){0.3Q, 0, 0}), lug = at(bucket, (vec){-0.05Q, 0.25Q, 0});
    vec d = minus(lug.place, eye.place), v = minus(lug.velocity, eye.velocity);
    m->gap[0] = (dot(d, d) - squared(0.33Q)) / 2;
    m->gap_rate[0] = dot(d, v);
    m->gap_second[0] = dot(v, v) + dot(d, minus(lug.acceleration, eye.acceleration));
    m->rows = 1;
    const frame both[CYLINDERS][2] = {{at(base, (vec){0.45Q, -0.35Q, 0}), at(boom, (vec){1.2Q, 0.25Q, 0})},
                                      {at(boom, (vec){1.3Q, 0.5Q, 0}), at(stick, (vec){-0.4Q, 0.1Q, 0})},
                                      {at(stick, (vec){0.1Q, 0.35Q, 0}), eye}};
    memcpy(ends, both, sizeof ends);
}

// The cylinders push their ends apart.
static void load(quad t, const quad *q, const quad *qd, motion *m, quad *torques)
{
    (void)t, (void)q, (void)qd, (void)torques;
    for (int k = 0; k < CYLINDERS; k++) {
        vec way = minus(ends[k][1].place, ends[k][0].place), rate = minus(ends[k][1].velocity, ends[k][0].velocity);
        length[k] = sqrtq(dot(way, way));
        speed[k] = dot(way, rate) / length[k];
        for (int i = 0; i < 2; i++)
            if (bodies[k][i] >= 0)
                push(&m->bodies[bodies[k][i]], times((i ? 1 : -1) * thrust[k] / length[k], way), ends[k][i].place);
    }
}

static const mechanism arm = {
    .n = BODIES, .bodies = BODIES, .rows = 1, .gravity = {0, -9.81Q, 0}, .move = move, .load = load};

// Turbulent flow by the root of the pressure drop, laminar near zero.
static quad flow(quad drop)
{
    return drop / sqrtq(sqrtq(drop * drop + low * low));
}

static void rates(quad t, const quad *state, quad *rate)
{
    const quad *p = state + PRESSURES, *x = state + SPOOLS;
    for (int k = 0; k < CYLINDERS; k++)
        thrust[k] = area[0] * p[2 * k] - area[1] * p[2 * k + 1];
    motion_rates(&arm, t, state, rate);
    for (int k = 0; k < CYLINDERS; k++) {
        quad wide = sqrtq(x[k] * x[k] + lap * lap), push = opening * (wide + x[k]) / 2,
             pull = opening * (wide - x[k]) / 2;
        quad a = push * flow(supply - p[2 * k]) - pull * flow(p[2 * k]);
        quad b = pull * flow(supply - p[2 * k + 1]) - push * flow(p[2 * k + 1]);
        rate[PRESSURES + 2 * k] = beta / (hose + area[0] * (length[k] - shortest[k])) * (a - area[0] * speed[k]);
        rate[PRESSURES + 2 * k + 1] = beta / (hose + area[1] * (longest[k] - length[k])) * (b + area[1] * speed[k]);
        rate[SPOOLS + k] = (command[k] - x[k]) / spool;
    }
}

// A cubic between two values.
static quad step(quad t, quad from, quad to)
{
    quad s = fminq(1, fmaxq(0, (t - 0.1Q) / 0.8Q));
    return degrees(from + (to - from) * s * s * (3 - 2 * s));
}

// Proportional and integral, taken back at the limits within the time of the integral.
static void control(quad t, const quad *q)
{
    const quad error[CYLINDERS] = {step(t, 25, 35) - q[BOOM], q[STICK] - step(t, -95, -75),
                                   q[BUCKET] - step(t, -60, -90)};
    for (int k = 0; k < CYLINDERS; k++) {
        quad sum = 8 * error[k] + integral[k];
        command[k] = fminq(1, fmaxq(-1, sum));
        integral[k] += sample * (6 * error[k] + (command[k] - sum) * 6 / 8);
    }
}

int main(int argc, char **argv)
{
    static const int closed[] = {ROCKER};
    quad h = 1e-3Q, state[STATE] = {degrees(25), degrees(-95), degrees(-60), degrees(80), [PRESSURES] = 5.2e6Q,
                                    3e6Q,        2.6e6Q,       2.6e6Q,       2.6e6Q,      2.7e6Q};
    area[0] = M_PIq / 4 * squared(0.09Q);
    area[1] = M_PIq / 4 * (squared(0.09Q) - squared(0.05Q));
    close_gaps(&arm, 0, state, NULL, closed);
    printf("# Kane's equations between samples by extrapolation in 113-bit arithmetic, by "
           "reference_hydraulic_excavator.c.\n");
    printf("t,q.boom,q.stick,q.bucket,q.rocker,qd.boom,qd.stick,qd.bucket,qd.rocker,state.boom_a,state.boom_b,state."
           "stick_a,"
           "state.stick_b,state.bucket_a,state.bucket_b,state.boom_valve,state.stick_valve,state.bucket_valve\n");
    for (int k = 0; k < 120; k++) {
        control(k * sample, state);
        integrate(rates, k * sample, (k + 1) * sample, tolerance(argc, argv), &h, STATE, state);
        if ((k + 1) % 24 == 0)
            row((k + 1) * sample, STATE, state, 17);
    }
    return 0;
}
