/* SPDX-License-Identifier: BSD-3-Clause */
/* Spread to q and qd by the tangent, through the exact derivatives of the residual, and back by X'. */
#include "constraints/partition/small_change.h"
#include "linalg/dense/dot.h"
#include <string.h>

void kmp_spread(const kmp_reduction *red, const double *du, const double *rows, double *room, double *out)
{
    memset(out, 0, (size_t)red->n * sizeof *out);
    for (int k = 0; du && k < red->p; k++)
        for (int i = 0; du[k] != 0 && i < red->n; i++)
            out[i] += red->x[i + k * red->n] * du[k];
    kmp_reduction_push_in(red, -1, rows, room, out);
}

void kmp_follow(kmp_reduction *red, const kmp_tangents *tangents, const double *d, bool moving,
                const kmp_change *change, const kmp_response *response, double *room)
{
    int n = red->n, m = red->part->m;
    double *two = room + 4 * n, *rows = room + 6 * n, *force = room;
    double *dq = response->q ? response->q : room + n, *dqd = response->qd ? response->qd : room + 2 * n;
    double *dqdd = response->qdd ? response->qdd : room + 3 * n;
    kmp_copy_or_zero(m, change->h, rows);
    kmp_spread(red, change->u, rows, two, dq);
    kmp_copy_or_zero(m, change->rate, rows);
    kmp_tangents_add(tangents, KMP_RATE_Q, d, 1, dq, rows);
    kmp_spread(red, change->ud, rows, two, dqd);
    if (!response->qdd && !response->lambda && !response->residual)
        return;
    kmp_copy_or_zero(m, change->curve, rows);
    kmp_tangents_add(tangents, KMP_CURVE_Q, d, 1, dq, rows);
    kmp_tangents_add(tangents, KMP_CURVE_QD, d, 1, dqd, rows);
    kmp_spread(red, change->udd, rows, two, dqdd);
    kmp_copy_or_zero(n, change->force, force);
    kmp_tangents_add(tangents, KMP_R_Q, d, 1, dq, force);
    kmp_tangents_add(tangents, KMP_R_QD, d, 1, dqd, force);
    kmp_tangents_add(tangents, KMP_M, d, 1, dqdd, force);
    kmp_reduction_load_change(red, moving, force);
    if (response->residual)
        kmp_reduction_project(red, force, response->residual);
    for (int k = 0; response->residual && k < red->p; k++)
        response->residual[k] = -response->residual[k];
    if (response->lambda)
        kmp_reduction_pull(red, force, response->lambda);
}
