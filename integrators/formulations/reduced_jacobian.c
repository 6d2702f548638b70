/* SPDX-License-Identifier: BSD-3-Clause */
#include "integrators/formulations/reduced_jacobian.h"
#include "linalg/dot.h"
#include <string.h>

/* -- small changes ----------------------------------------------------------------------------------- */

void kmp_spread(kmp_reduction *red, const double *du, const double *rows, double *out)
{
    memset(out, 0, (size_t)red->n * sizeof *out);
    for (int k = 0; du && k < red->p; k++)
        for (int i = 0; du[k] != 0 && i < red->n; i++)
            out[i] += red->x[i + k * red->n] * du[k];
    kmp_reduction_push(red, -1, rows, out);
}

void kmp_follow(kmp_reduction *red, const kmp_tangents *tangents, const double *d, bool moving,
                const kmp_change *change, const kmp_response *response, double *room)
{
    int n = red->n, m = red->part->m;
    double *rows = room + 4 * n, *force = room;
    double *dq = response->q ? response->q : room + n, *dqd = response->qd ? response->qd : room + 2 * n;
    double *dqdd = response->qdd ? response->qdd : room + 3 * n;
    kmp_copy_or_zero(m, change->h, rows);
    kmp_spread(red, change->u, rows, dq);
    kmp_copy_or_zero(m, change->rate, rows);
    kmp_tangents_add(tangents, KMP_RATE_Q, d, 1, dq, rows);
    kmp_spread(red, change->ud, rows, dqd);
    kmp_copy_or_zero(m, change->curve, rows);
    kmp_tangents_add(tangents, KMP_CURVE_Q, d, 1, dq, rows);
    kmp_tangents_add(tangents, KMP_CURVE_QD, d, 1, dqd, rows);
    kmp_spread(red, change->udd, rows, dqdd);
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

/* -- the Jacobian ------------------------------------------------------------------------------------ */

kempe_status kmp_reduced_jacobian_init(kmp_reduced_jacobian *jacobian, kmp_reduction *red, bool power)
{
    int n = red->n, m = red->part->m;
    *jacobian = (kmp_reduced_jacobian){.red = red};
    if (!KMP_ARENA_MAKE(&jacobian->arena, KMP_ROOM(double, n, &jacobian->qdd, &jacobian->dq, &jacobian->dqd),
                        KMP_ROOM(double, m, &jacobian->lambda), KMP_ROOM(double, 2 * red->p, &jacobian->unit),
                        KMP_ROOM(double, 5 * n + m, &jacobian->room)))
        return kmp_fail_memory(red->eval->system->context);
    return kmp_tangents_init(&jacobian->tangents, red->eval->system, red->eval->backend,
                             KMP_TANGENTS_NEAR | (power ? 1u << KMP_VALUE_POWER : 0));
}

void kmp_reduced_jacobian_free(kmp_reduced_jacobian *jacobian)
{
    kmp_tangents_free(&jacobian->tangents);
    kmp_arena_free(&jacobian->arena);
    *jacobian = (kmp_reduced_jacobian){0};
}

/* Derivatives at (t, q, qd, udd), with the multipliers of the evaluator's state. */
static const double *derive(kmp_reduced_jacobian *jacobian, bool moving, double t, const double *q, const double *qd,
                            const double *udd)
{
    kmp_reduction *red = jacobian->red;
    kmp_reduction_accelerations(red, udd, jacobian->qdd);
    kmp_reduction_multipliers(red, jacobian->qdd, jacobian->lambda);
    kmp_instant at = kmp_instant_of(red->eval, t, q, qd, jacobian->qdd, jacobian->lambda);
    (void)kmp_reduction_load_factor(red, moving);
    return kmp_tangents_derivatives(&jacobian->tangents, &at);
}

/* Follows column c, of u and then of ud, with cj times the accelerations: sets dR, returns the change of the power. */
static double follow(kmp_reduced_jacobian *jacobian, const double *d, bool moving, double cj, int c, double *residual)
{
    kmp_reduction *red = jacobian->red;
    const kmp_tangents *t = &jacobian->tangents;
    int p = red->p;
    double *unit = jacobian->unit, *udd = unit + p, power = 0;
    memset(unit, 0, (size_t)(2 * p) * sizeof *unit);
    unit[c % p] = 1;
    udd[c % p] = c < p ? 0 : cj;
    const kmp_response response = {.q = jacobian->dq, .qd = jacobian->dqd, .residual = residual};
    kmp_follow(red, t, d, moving, &(kmp_change){.u = c < p ? unit : NULL, .ud = c < p ? NULL : unit, .udd = udd},
               &response, jacobian->room);
    kmp_tangents_add(t, KMP_POWER_Q, d, 1, jacobian->dq, &power);
    kmp_tangents_add(t, KMP_POWER_QD, d, 1, jacobian->dqd, &power);
    return power;
}

void kmp_reduced_jacobian_eval(kmp_reduced_jacobian *jacobian, double t, const double *q, const double *qd,
                               const double *udd, int size, double *j)
{
    kmp_reduction *red = jacobian->red;
    int p = red->p;
    const double *d = derive(jacobian, true, t, q, qd, udd);
    for (int c = 0; c < 2 * p; c++) {
        double *column = j + c * size, power = follow(jacobian, d, true, 0, c, column + p);
        if (c >= p)
            column[c - p] = 1;
        for (int k = 0; k < p; k++)
            column[p + k] = -column[p + k];
        kmp_reduction_solve_mass(red, column + p);
        if (size > 2 * p)
            column[2 * p] = power;
    }
}

/* d(M qdd + C - J' lambda) = 0 as a separate system: X' eliminates J' times the change of X. */
void kmp_reduced_jacobian_of_residual(kmp_reduced_jacobian *jacobian, double t, double cj, const double *q,
                                      const double *qd, const double *udd, int size, double *j)
{
    int p = jacobian->red->p;
    const double *d = derive(jacobian, false, t, q, qd, udd);
    for (int c = 0; c < 2 * p; c++) {
        double *column = j + c * size, power = follow(jacobian, d, false, cj, c, column + p);
        column[c % p] = c < p ? cj : -1;
        if (size > 2 * p)
            column[2 * p] = -power;
    }
    if (size > 2 * p)
        j[2 * p + 2 * p * size] = cj;
}
