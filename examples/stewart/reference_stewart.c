// SPDX-License-Identifier: BSD-3-Clause
// The platform by Kane's equations of its six degrees of freedom in 113-bit arithmetic (../references/kane.h): the
// angles of a leg's universal joint and its length follow from the point that it supports.
//
//     reference_stewart > reference.csv
#include "../references/kane.h"

static const vec X = {1, 0, 0}, Y = {0, 1, 0}, Z = {0, 0, 1};

// Ends of a leg at the start: on circles of 1 m and 0.5 m.
static void ends(int leg, vec *base, vec *top)
{
    const int of_base[] = {-10, 10, 110, 130, 230, 250}, of_top[] = {-50, 50, 70, 170, 190, 290};
    quad b = degrees(of_base[leg]), p = degrees(of_top[leg]);
    *base = (vec){cosq(b), sinq(b), 0};
    *top = (vec){cosq(p) / 2, sinq(p) / 2, 0};
}

// A uniform matrix of inertia but along e.
static void slender(quad axial, quad across, vec e, quad *inertia)
{
    quad less = axial - across;
    const quad of[] = {across + less * e.x * e.x, across + less * e.y * e.y, across + less * e.z * e.z,
                       less * e.x * e.y,          less * e.x * e.z,          less * e.y * e.z};
    memcpy(inertia, of, sizeof of);
}

static frame half(vec base, vec e, const quad *s, const quad *sd, const quad *sdd, frame *lower)
{
    *lower = turn(turn(at(ground(), base), X, s[0], sd[0], sdd[0]), Y, s[1], sd[1], sdd[1]);
    return slide(*lower, e, s[2], sd[2], sdd[2]);
}

// x of a . x = b, columns a.
static void three(const frame *a, vec b, quad *x)
{
    quad m[9];
    for (int k = 0; k < 3; k++) {
        m[k] = a[k].velocity.x;
        m[3 + k] = a[k].velocity.y;
        m[6 + k] = a[k].velocity.z;
    }
    x[0] = b.x;
    x[1] = b.y;
    x[2] = b.z;
    solve(3, m, x);
}

// Both halves of a leg from its base to a given point of the platform: R1(s0) R2(s1) e s2 is the way.
static void leg(vec base, vec e, const frame *point, frame *lower, frame *upper)
{
    static const quad none[3];
    vec way = minus(point->place, base);
    quad length = sqrtq(dot(way, way)), far = sqrtq(e.x * e.x + e.z * e.z);
    quad turned = atan2q(e.x, e.z), s[3], sd[3], sdd[3];
    s[1] = asinq(way.x / length / far) - turned; // e.x cos + e.z sin = far sin(s1 + turned)
    s[0] = atan2q(way.z, way.y) - atan2q(far * cosq(s[1] + turned), e.y);
    s[2] = length;
    frame each[3], ignored;
    for (int k = 0; k < 3; k++) {
        quad one[3] = {0};
        one[k] = 1;
        each[k] = half(base, e, s, one, none, &ignored);
    }
    three(each, point->velocity, sd);
    frame bias = half(base, e, s, sd, none, &ignored);
    three(each, minus(point->acceleration, bias.acceleration), sdd);
    *upper = half(base, e, s, sd, sdd, lower);
}

static void move(quad t, const quad *q, const quad *qd, const quad *qdd, motion *m)
{
    (void)t;
    const vec axes[] = {X, Y, Z, X, Y, Z};
    frame platform = at(ground(), Z);
    for (int k = 0; k < 6; k++)
        platform = (k < 3 ? slide : turn)(platform, axes[k], q[k], qd[k], qdd[k]);
    m->bodies[0] = (body){.frame = platform, .mass = 10, .inertia = {0.6Q, 0.7Q, 1.2Q}};
    for (int k = 0; k < 6; k++) {
        vec base, top;
        ends(k, &base, &top);
        vec e = unit(add(minus(top, base), Z));
        frame point = at(platform, top), lower, upper;
        leg(base, e, &point, &lower, &upper);
        body *low = &m->bodies[1 + 2 * k], *high = low + 1;
        *low = (body){.frame = at(lower, times(0.25Q, e)), .mass = 1};
        *high = (body){.frame = at(upper, times(-0.25Q, e)), .mass = 0.5Q};
        slender(0.001Q, 0.02Q, e, low->inertia);
        slender(0.0005Q, 0.01Q, e, high->inertia);
    }
}

static void load(quad t, const quad *q, const quad *qd, motion *m, quad *torques)
{
    (void)t, (void)q, (void)qd, (void)torques;
    for (int k = 0; k < 6; k++) {
        vec base, top;
        ends(k, &base, &top);
        vec way = add(minus(top, base), Z);
        frame foot = at(ground(), base), point = at(m->bodies[0].frame, top);
        spring(NULL, &foot, &m->bodies[0], &point, 2000, 10, sqrtq(dot(way, way)));
    }
}

static const mechanism SYSTEM = {.n = 6, .bodies = 13, .gravity = {0, 0, -9.81Q}, .move = move, .load = load};

static void rates(quad t, const quad *state, quad *rate)
{
    motion_rates(&SYSTEM, t, state, rate);
}

int main(int argc, char **argv)
{
    const quad times[] = {0, 0.1Q, 0.25Q, 0.5Q, 1};
    quad h = 1e-2Q, state[12] = {[6] = 0.5Q, [9] = -0.5Q, [11] = 1};
    printf("# Kane's equations in 113-bit arithmetic, by reference_stewart.c; two tolerances agree on all digits.\n");
    printf("t,q.platform.1,q.platform.2,q.platform.3,q.platform.4,q.platform.5,q.platform.6\n");
    for (int k = 1; k < 5; k++) {
        integrate(rates, times[k - 1], times[k], tolerance(argc, argv), &h, 12, state);
        row(times[k], 6, state, 15);
    }
    return 0;
}
