/* SPDX-License-Identifier: BSD-3-Clause */
/* Prediction of v in the newton form. From the last accepted step v follows its tangent and curvature; what they leave
 * open at states that have been closed since then, or shortly before, is interpolated and added. States are placed by
 * their progress s along the rates of u at the step: with one degree of freedom v is a function of s. The remainder is
 * a polynomial in s that begins with its third power. */
#include "constraints/tolerances.h"
#include "integrators/formulations/reduced.h"
#include <float.h>
#include <math.h>
#include <string.h>

/* Largest sum of the magnitudes of weights: errors of states grow by it. */
#define WEIGHTS 4.0

/* Progress of u since the last accepted step, in its time. */
static double progress_of(const kmp_reduced *d, double t, const double *u)
{
    double along = 0;
    if (d->by_time)
        return t - d->t;
    for (int k = 0; k < d->p; k++)
        along += d->anchor_w[k] * (u[k] - d->anchor_u[k]);
    return along;
}

/* The weights of u in the progress: rates over their square, in scales. */
static void set_progress(kmp_reduced *d, const double *ud)
{
    double speed = 0;
    for (int k = 0; k < d->p; k++) {
        double scale = d->s->scale[d->part.u[k]];
        d->anchor_w[k] = ud[k] / (scale * scale);
        speed += d->anchor_w[k] * ud[k];
    }
    d->by_time = d->s->rheonomic || !(speed > DBL_MIN);
    for (int k = 0; k < d->p; k++)
        d->anchor_w[k] /= speed;
}

/* v along the tangent and its curvature: B du + x_t tau + c s^2 / 2. */
static void extrapolate(const kmp_reduced *d, double t, const double *u, double s, double *v)
{
    double tau = t - d->t, half = 0.5 * s * s;
    for (int i = 0; i < d->r; i++)
        v[i] = d->anchor_v[i] + tau * d->anchor_t[i] + half * d->anchor_c[i];
    for (int k = 0; k < d->p; k++) {
        const double *b = d->anchor_b + k * d->r;
        double du = u[k] - d->anchor_u[k];
        for (int i = 0; i < d->r; i++)
            v[i] += b[i] * du;
    }
}

/* Weights of the last states: (s / s_j)^3 times Lagrange's polynomial. Returns the sum of their magnitudes. */
static double find_weights(double s, int count, const double *at, double *weight)
{
    double sum = 0;
    for (int j = 0; j < count; j++) {
        double above = s * s * s, below = at[j] * at[j] * at[j];
        for (int k = 0; k < count; k++) {
            above *= k == j ? 1 : s - at[k];
            below *= k == j ? 1 : at[j] - at[k];
        }
        weight[j] = above / below;
        sum += fabs(weight[j]);
    }
    return sum;
}

/* The remainder at s of as many of the last states as have small weights. */
static void add_remainder(kmp_reduced *d, double s)
{
    double weight[KMP_REDUCED_STATES], at[KMP_REDUCED_STATES];
    int place[KMP_REDUCED_STATES], count = 0;
    for (int k = 0; k < d->states; k++) {
        int j = (d->last_state - k + KMP_REDUCED_STATES) % KMP_REDUCED_STATES;
        if (fabs(d->state_s[j]) > KMP_PREDICTION_APART * fabs(s)) {
            place[count] = j;
            at[count++] = d->state_s[j];
        }
    }
    while (count > 0 && !(find_weights(s, count, at, weight) <= WEIGHTS))
        count--;
    for (int i = 0; i < d->r; i++) {
        double remainder = 0;
        for (int j = 0; j < count; j++)
            remainder += weight[j] * d->state_e[place[j] * d->r + i];
        if (fabs(remainder) * d->by_scale[i] <= KMP_PREDICTION_TRUST)
            d->v[i] += remainder;
    }
}

void kmp_reduced_extrapolate(kmp_reduced *d, double t, const double *u)
{
    d->s_here = progress_of(d, t, u);
    extrapolate(d, t, u, d->s_here, d->v_here);
    memcpy(d->v, d->v_here, (size_t)d->r * sizeof *d->v);
}

void kmp_reduced_predict(kmp_reduced *d, double t, const double *u)
{
    kmp_reduced_extrapolate(d, t, u);
    if (d->states > 0 && d->s_here != 0)
        add_remainder(d, d->s_here);
}

void kmp_reduced_note(kmp_reduced *d, double t, const double *u)
{
    int j = d->last_state;
    bool same = d->states > 0 && fabs(d->s_here - d->state_s[j]) <= KMP_PREDICTION_APART * fabs(d->s_here);
    if (!same) {
        d->last_state = j = (j + 1) % KMP_REDUCED_STATES;
        d->states = d->states < KMP_REDUCED_STATES ? d->states + 1 : d->states;
    }
    d->state_t[j] = t;
    d->state_s[j] = d->s_here;
    memcpy(d->state_u + j * d->p, u, (size_t)d->p * sizeof *u);
    for (int i = 0; i < d->r; i++) {
        d->state_v[j * d->r + i] = d->v[i];
        d->state_e[j * d->r + i] = d->v[i] - d->v_here[i];
    }
}

/* The i-th component of vdd without the part of udd. */
static double vdd_alone(const kmp_reduced *d, int i)
{
    double vdd = d->by_saddle ? d->qdd[d->part.v[i]] : d->red.a0[d->part.v[i]];
    for (int k = 0; d->by_saddle && k < d->p; k++)
        vdd -= d->red.bvu[i + k * d->r] * d->qdd[d->part.u[k]];
    return vdd;
}

/* States before the step, seen from its end. */
static void see_from_here(kmp_reduced *d)
{
    for (int j = 0; j < d->states; j++) {
        const double *u = d->state_u + j * d->p, *v = d->state_v + j * d->r;
        double *e = d->state_e + j * d->r;
        d->state_s[j] = progress_of(d, d->state_t[j], u);
        extrapolate(d, d->state_t[j], u, d->state_s[j], e);
        for (int i = 0; i < d->r; i++)
            e[i] = v[i] - e[i];
    }
}

static void weigh(kmp_reduced *d)
{
    for (int i = 0; i < d->n; i++)
        d->weight[i] = d->start.atol * d->s->scale[i] + d->start.rtol * fabs(d->q[i]);
    for (int i = 0; i < d->r; i++) {
        d->by_scale[i] = 1 / d->s->scale[d->part.v[i]];
        d->by_weight[i] = 1 / d->weight[d->part.v[i]];
    }
    d->noise = kmp_close_noise(d->n, d->s->scale, d->q);
}

void kmp_reduced_remember(kmp_reduced *d, double t, const double *y)
{
    d->t = t;
    if (d->integrated)
        return;
    weigh(d);
    if (d->has_v)
        return;
    memcpy(d->anchor_u, y, (size_t)d->p * sizeof *d->anchor_u);
    set_progress(d, y + d->p);
    memcpy(d->anchor_b, d->red.bvu, (size_t)(d->r * d->p) * sizeof *d->anchor_b);
    for (int i = 0; i < d->r; i++) {
        d->anchor_v[i] = d->q[d->part.v[i]];
        d->anchor_t[i] = d->red.x_t[d->part.v[i]];
        d->anchor_c[i] = vdd_alone(d, i);
    }
    see_from_here(d);
}
