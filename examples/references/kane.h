// SPDX-License-Identifier: BSD-3-Clause
// Kane's equations for the programs examples/NAME/reference_NAME.c, by forward kinematics alone: a program says where
// its bodies are, how fast and how accelerated for given coordinates, rates and accelerations. Partial velocities are
// the velocities at one rate that is one; no derivative is taken, symbolic or by differences, and no recursion goes
// inwards. T. R. Kane and D. A. Levinson, Dynamics: Theory and Applications, McGraw-Hill, 1985.
#ifndef KEMPE_EXAMPLES_KANE_H
#define KEMPE_EXAMPLES_KANE_H

#include "quad.h"

typedef struct vec {
    quad x, y, z;
} vec;

static inline vec add(vec a, vec b)
{
    return (vec){a.x + b.x, a.y + b.y, a.z + b.z};
}

static inline vec times(quad f, vec a)
{
    return (vec){f * a.x, f * a.y, f * a.z};
}

static inline vec minus(vec a, vec b)
{
    return (vec){a.x - b.x, a.y - b.y, a.z - b.z};
}

static inline quad dot(vec a, vec b)
{
    return a.x * b.x + a.y * b.y + a.z * b.z;
}

static inline vec cross(vec a, vec b)
{
    return (vec){a.y * b.z - a.z * b.y, a.z * b.x - a.x * b.z, a.x * b.y - a.y * b.x};
}

static inline vec unit(vec a)
{
    return times(1 / sqrtq(dot(a, a)), a);
}

// Axes in space: place, velocity, acceleration of the origin, then turning rate and turning acceleration.
typedef struct frame {
    vec e[3];
    vec place, velocity, acceleration, turning, turned;
} frame;

static inline frame ground(void)
{
    return (frame){.e = {{1, 0, 0}, {0, 1, 0}, {0, 0, 1}}};
}

// A vector given by its components along the axes.
static inline vec along(const frame *f, vec a)
{
    return add(add(times(a.x, f->e[0]), times(a.y, f->e[1])), times(a.z, f->e[2]));
}

// The axes carried to another point of the same body.
static inline frame at(frame f, vec local)
{
    vec lever = along(&f, local), rate = cross(f.turning, lever);
    f.place = add(f.place, lever);
    f.velocity = add(f.velocity, rate);
    f.acceleration = add(f.acceleration, add(cross(f.turned, lever), cross(f.turning, rate)));
    return f;
}

// The axes slide by q along a direction of their own.
static inline frame slide(frame f, vec direction, quad q, quad qd, quad qdd)
{
    vec e = along(&f, direction), rate = times(qd, e);
    f = at(f, times(q, direction));
    f.velocity = add(f.velocity, rate);
    f.acceleration = add(f.acceleration, add(times(qdd, e), times(2, cross(f.turning, rate))));
    return f;
}

// The axes turn by q about a direction of their own, of length one (Rodrigues' formula).
static inline frame turn(frame f, vec direction, quad q, quad qd, quad qdd)
{
    vec e = along(&f, direction), rate = times(qd, e);
    f.turned = add(f.turned, add(times(qdd, e), cross(f.turning, rate)));
    f.turning = add(f.turning, rate);
    quad cosine, sine;
    sincosq(q, &sine, &cosine);
    for (int k = 0; k < 3; k++) {
        vec a = f.e[k];
        f.e[k] = add(add(times(cosine, a), times(sine, cross(e, a))), times((1 - cosine) * dot(e, a), e));
    }
    return f;
}

// A rigid body: its axes carried to the centre of mass; inertia xx, yy, zz, xy, xz, yz about it in these axes.
typedef struct body {
    frame frame;
    quad mass, inertia[6];
    vec force, torque; // applied at the centre of mass
} body;

static inline vec momentum(const body *b, vec w)
{
    const quad *i = b->inertia;
    vec l = {dot(w, b->frame.e[0]), dot(w, b->frame.e[1]), dot(w, b->frame.e[2])};
    return along(&b->frame, (vec){i[0] * l.x + i[3] * l.y + i[4] * l.z, i[3] * l.x + i[1] * l.y + i[5] * l.z,
                                  i[4] * l.x + i[5] * l.y + i[2] * l.z});
}

static inline void push(body *b, vec force, vec place)
{
    b->force = add(b->force, force);
    b->torque = add(b->torque, cross(minus(place, b->frame.place), force));
}

// Spring and damper between two points, of a body each or of the ground (NULL).
static inline void spring(body *a, const frame *pa, body *b, const frame *pb, quad stiffness, quad damping, quad free)
{
    vec way = minus(pb->place, pa->place), rate = minus(pb->velocity, pa->velocity);
    quad length = sqrtq(dot(way, way));
    vec pull = times((stiffness * (length - free) + damping * dot(way, rate) / length) / length, way);
    if (a)
        push(a, pull, pa->place);
    if (b)
        push(b, times(-1, pull), pb->place);
}

enum { MOST_BODIES = 16, MOST_ROWS = 24 };

// The positions of all parts, which the function `move` of a mechanism fills in. The gap of a closure is one point
// minus the other.
typedef struct motion {
    body bodies[MOST_BODIES];
    quad gap[MOST_ROWS], gap_rate[MOST_ROWS], gap_second[MOST_ROWS];
    int rows; // of gaps so far
} motion;

static inline void close_at(motion *m, const frame *a, const frame *b, int first, int last)
{
    vec gap = minus(a->place, b->place), rate = minus(a->velocity, b->velocity),
        second = minus(a->acceleration, b->acceleration);
    for (int k = first; k <= last; k++) {
        m->gap[m->rows] = (&gap.x)[k];
        m->gap_rate[m->rows] = (&rate.x)[k];
        m->gap_second[m->rows++] = (&second.x)[k];
    }
}

typedef struct mechanism {
    int n, bodies, rows; // coordinates, bodies, rows of closures
    vec gravity;
    void (*move)(quad t, const quad *q, const quad *qd, const quad *qdd, motion *m);
    void (*load)(quad t, const quad *q, const quad *qd, motion *m, quad *torques); // may be NULL
} mechanism;

// Partial velocities: the motion at each rate that is one.
static inline void partials(const mechanism *m, quad t, const quad *q, motion *each)
{
    static const quad none[MOST];
    for (int i = 0; i < m->n; i++) {
        quad one[MOST] = {0};
        one[i] = 1;
        each[i].rows = 0;
        m->move(t, q, one, none, &each[i]);
    }
}

// Accelerations, then multipliers, with M qdd + C = Q + J' lambda.
static inline void accelerations(const mechanism *m, quad t, const quad *q, const quad *qd, quad *out)
{
    static const quad none[MOST];
    static motion each[MOST_ROWS], bias;
    int size = m->n + m->rows;
    quad a[MOST * MOST] = {0}, torques[MOST] = {0};
    memset(&bias, 0, sizeof bias);
    m->move(t, q, qd, none, &bias);
    if (m->load)
        m->load(t, q, qd, &bias, torques);
    partials(m, t, q, each);
    for (int i = 0; i < m->n; i++) {
        quad sum = torques[i];
        for (int k = 0; k < m->bodies; k++) {
            const body *b = &bias.bodies[k];
            const frame *f = &b->frame, *p = &each[i].bodies[k].frame;
            vec force = add(b->force, times(b->mass, minus(m->gravity, f->acceleration)));
            vec gyro = add(momentum(b, f->turned), cross(f->turning, momentum(b, f->turning)));
            sum += dot(p->velocity, force) + dot(p->turning, minus(b->torque, gyro));
            for (int j = 0; j < m->n; j++) {
                const frame *o = &each[j].bodies[k].frame;
                a[i * size + j] += b->mass * dot(p->velocity, o->velocity) + dot(p->turning, momentum(b, o->turning));
            }
        }
        out[i] = sum;
        for (int r = 0; r < m->rows; r++) {
            a[i * size + m->n + r] = -each[i].gap_rate[r];
            a[(m->n + r) * size + i] = each[i].gap_rate[r];
        }
    }
    for (int r = 0; r < m->rows; r++)
        out[m->n + r] = -bias.gap_second[r];
    solve(size, a, out);
}

// Of the state q, qd.
static inline void motion_rates(const mechanism *m, quad t, const quad *state, quad *rate)
{
    quad out[MOST];
    accelerations(m, t, state, state + m->n, out);
    memcpy(rate, state + m->n, (size_t)m->n * sizeof *rate);
    memcpy(rate + m->n, out, (size_t)m->n * sizeof *rate);
}

// Closes the gaps by the coordinates or rates (`rates`: not NULL) of `which`, one for each row; the others remain.
static inline void close_gaps(const mechanism *m, quad t, quad *q, quad *rates, const int *which)
{
    static const quad none[MOST];
    static motion each[MOST_ROWS], now;
    for (int iteration = 0; iteration < (rates ? 1 : 40); iteration++) {
        quad a[MOST * MOST], b[MOST], size = 0;
        now.rows = 0;
        m->move(t, q, rates ? rates : none, none, &now);
        partials(m, t, q, each);
        for (int r = 0; r < m->rows; r++) {
            for (int k = 0; k < m->rows; k++)
                a[r * m->rows + k] = each[which[k]].gap_rate[r];
            b[r] = rates ? now.gap_rate[r] : now.gap[r];
        }
        solve(m->rows, a, b);
        for (int k = 0; k < m->rows; k++) {
            (rates ? rates : q)[which[k]] -= b[k];
            size += fabsq(b[k]);
        }
        if (size < 1e-32Q)
            break;
    }
}

#endif
