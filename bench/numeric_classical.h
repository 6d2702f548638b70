/* SPDX-License-Identifier: BSD-3-Clause */
/* The classical non-recursive form (classical.h) as a plain numeric program: places, rates and accelerations of all
 * links in ground axes, then of each body with mass the partial velocities of all joints below it, and its share of M
 * for each two of them. */
#ifndef KEMPE_BENCH_NUMERIC_CLASSICAL_H
#define KEMPE_BENCH_NUMERIC_CLASSICAL_H

#include "bench/numeric_closures.h"
#include "model/data/force.h"

/* About the centre of mass, link axes. */
typedef struct numeric_mass_of {
    double com[3], inertia[3][3];
} numeric_mass_of;

typedef struct numeric_partial {
    double v[3], turned[3]; /* of the body's centre of mass; I w */
} numeric_partial;

typedef struct numeric_classical {
    numeric_closures ground; /* of all links, seen from the ground */
    numeric_mass_of *bodies;
    numeric_partial *partials; /* of the joints below the body at hand */
} numeric_classical;

static inline void numeric_classical_free(numeric_classical *c)
{
    kmp_free(c->ground.places);
    kmp_free(c->bodies);
    kmp_free(c->partials);
    *c = (numeric_classical){0};
}

static inline bool numeric_classical_init(numeric_classical *c, const numeric *p)
{
    *c = (numeric_classical){.ground = {.tree = p, .places = KMP_NEW(numeric_place, p->count)},
                             .bodies = KMP_NEW(numeric_mass_of, p->count),
                             .partials = KMP_NEW(numeric_partial, p->count)};
    if (!c->ground.places || !c->bodies || !c->partials) {
        numeric_classical_free(c);
        return false;
    }
    c->ground.places[0] = (numeric_place){.r = {{1, 0, 0}, {0, 1, 0}, {0, 0, 1}}};
    for (int b = 1; b < p->count; b++) {
        const numeric_link *l = &p->links[b];
        numeric_mass_of *to = &c->bodies[b];
        double square = 0;
        for (int k = 0; k < 3; k++) {
            to->com[k] = l->mass > 0 ? l->first[k] / l->mass : 0;
            square += to->com[k] * to->com[k];
        }
        for (int i = 0; i < 3; i++)
            for (int j = 0; j < 3; j++)
                to->inertia[i][j] = l->second[i][j] - l->mass * ((i == j ? square : 0) - to->com[i] * to->com[j]);
    }
    return true;
}

/* m by rows. */
NUMERIC_INLINE void numeric_times(const double *m, const double v[3], double out[3])
{
    for (int i = 0; i < 3; i++)
        out[i] = m[3 * i] * v[0] + m[3 * i + 1] * v[1] + m[3 * i + 2] * v[2];
}

NUMERIC_INLINE double numeric_dot(const double a[3], const double b[3])
{
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
}

/* f = m (a - g) and n = I wd + w x (I w) of body b, at x with the inertia `in`, ground axes. */
static inline void numeric_power(const numeric_classical *c, int b, double x[3], double in[3][3], double f[3],
                                 double n[3])
{
    const numeric *p = c->ground.tree;
    const numeric_place *place = &c->ground.places[b];
    double arm[3], v[3] = {0}, a[3] = {place->a[0], place->a[1], place->a[2]}, turning[3];
    numeric_times(place->r[0], c->bodies[b].com, arm);
    numeric_turning(place, arm, v, a);
    memcpy(in, c->bodies[b].inertia, 9 * sizeof(double));
    numeric_turn_by(place->r, in);
    for (int k = 0; k < 3; k++) {
        x[k] = place->o[k] + arm[k];
        f[k] = p->links[b].mass * (a[k] - p->gravity[k]);
    }
    numeric_times(in[0], place->wd, n);
    numeric_times(in[0], place->w, turning);
    numeric_add_cross(n, place->w, turning);
}

static inline void numeric_classical_body(const numeric_classical *c, int b, double *m, double *bias)
{
    const numeric *p = c->ground.tree;
    double x[3], in[3][3], f[3], n[3], mass = p->links[b].mass;
    numeric_power(c, b, x, in, f, n);
    for (int k = b; k > 0; k = p->links[k].parent) {
        const numeric_place *joint = &c->ground.places[k];
        numeric_partial *to = &c->partials[k];
        if (!p->links[k].rotation) {
            memcpy(to->v, joint->axis, sizeof to->v);
            bias[k - 1] += numeric_dot(joint->axis, f);
            continue;
        }
        double arm[3] = {x[0] - joint->o[0], x[1] - joint->o[1], x[2] - joint->o[2]};
        memset(to->v, 0, sizeof to->v);
        numeric_add_cross(to->v, joint->axis, arm);
        numeric_times(in[0], joint->axis, to->turned);
        bias[k - 1] += numeric_dot(to->v, f) + numeric_dot(joint->axis, n);
    }
    for (int k = b; k > 0; k = p->links[k].parent)
        for (int j = k; j > 0; j = p->links[j].parent) {
            double *entry = &m[(k - 1) * p->n + j - 1];
            *entry += mass * numeric_dot(c->partials[k].v, c->partials[j].v);
            if (p->links[k].rotation && p->links[j].rotation)
                *entry += numeric_dot(c->partials[k].turned, c->ground.places[j].axis);
        }
}

/* M (lower triangle) and c. */
static inline void numeric_classical_motion(const numeric_classical *c, numeric *p, const double *q, const double *qd,
                                            double *m, double *bias)
{
    numeric_angles(p, q);
    memset(bias, 0, (size_t)p->n * sizeof *bias);
    for (int i = 1; i < p->count; i++) {
        numeric_place_link(&c->ground, i, &c->ground.places[p->links[i].parent], qd[i - 1]);
        for (int k = i; k > 0; k = p->links[k].parent)
            m[(i - 1) * p->n + k - 1] = 0;
    }
    for (int b = 1; b < p->count; b++)
        if (p->links[b].heavy)
            numeric_classical_body(c, b, m, bias);
}

#endif
