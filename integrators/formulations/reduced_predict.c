/* SPDX-License-Identifier: BSD-3-Clause */
/* Prediction of v in the newton form where it is not among the unknowns: along its tangent and curvature from the last
 * accepted step. */
#include "integrators/formulations/reduced.h"
#include <float.h>
#include <math.h>
#include <string.h>

/* B du + x_t tau + c s^2 / 2. */
void kmp_reduced_predict(kmp_reduced *d, double t, const double *u)
{
    double tau = t - d->t, s = 0; /* progress of u since the last accepted step, in its time */
    for (int k = 0; k < d->p; k++)
        s += d->anchor_w[k] * (u[k] - d->anchor_u[k]);
    s = d->by_time ? tau : s;
    const double half = 0.5 * s * s;
    const kmp_sparse_tangent *zeros = d->red.zeros;
    for (int i = 0; i < d->r; i++)
        d->v[i] = d->anchor_v[i] + tau * d->anchor_t[i] + half * d->anchor_c[i];
    for (int k = 0; k < d->p; k++) {
        const double *b = d->anchor_b + k * d->r;
        double du = u[k] - d->anchor_u[k];
        if (zeros) {
            const int *row;
            for (int e = 0, count = kmp_sparse_tangent_rows(zeros, k, &row); e < count; e++)
                d->v[row[e]] += b[row[e]] * du;
            continue;
        }
        for (int i = 0; i < d->r; i++)
            d->v[i] += b[i] * du;
    }
}

void kmp_reduced_remember_place(kmp_reduced *d, double t, const double *y)
{
    d->t = t;
    if (d->integrated)
        return;
    /* Weights of errors of v, and the noise of closing. */
    for (int i = 0; i < d->n; i++)
        d->weight[i] = d->start.atol * d->s->scale[i] + d->start.rtol * fabs(d->q[i]);
    for (int i = 0; i < d->r; i++) {
        d->by_scale[i] = 1 / d->s->scale[d->part.v[i]];
        d->by_weight[i] = 1 / d->weight[d->part.v[i]];
    }
    d->noise = kmp_close_noise(d->n, d->s->scale, d->q);
    if (d->has_v)
        return;
    memcpy(d->anchor_u, y, (size_t)d->p * sizeof *d->anchor_u);
    /* The weights of u in the progress: rates over their square, in scales. */
    const double *ud = y + d->p;
    double speed = 0;
    for (int k = 0; k < d->p; k++) {
        double scale = d->s->scale[d->part.u[k]];
        d->anchor_w[k] = ud[k] / (scale * scale);
        speed += d->anchor_w[k] * ud[k];
    }
    d->by_time = d->s->rheonomic || !(speed > DBL_MIN);
    for (int k = 0; k < d->p; k++)
        d->anchor_w[k] /= speed;
    memcpy(d->anchor_b, d->red.bvu, (size_t)(d->r * d->p) * sizeof *d->anchor_b);
    for (int i = 0; i < d->r; i++) {
        d->anchor_v[i] = d->q[d->part.v[i]];
        d->anchor_t[i] = d->red.x_t[d->part.v[i]];
    }
}

void kmp_reduced_remember(kmp_reduced *d, double t, const double *y)
{
    kmp_reduced_remember_place(d, t, y);
    for (int i = 0; !d->has_v && i < d->r; i++) {
        /* The i-th component of vdd without the part of udd. */
        double vdd = d->by_saddle ? d->qdd[d->part.v[i]] : d->red.a0[d->part.v[i]];
        for (int k = 0; d->by_saddle && k < d->p; k++)
            vdd -= d->red.bvu[i + k * d->r] * d->qdd[d->part.u[k]];
        d->anchor_c[i] = vdd;
    }
}
