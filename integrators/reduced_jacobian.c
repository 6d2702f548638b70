/* SPDX-License-Identifier: BSD-3-Clause */
/* Along a change (du, dud) of the state the closed mechanism moves by
 *
 *     dq = X du      J dqd + (J qd + h_t)_q dq = 0      J dqdd + (J qdd + gamma)_q dq + gamma_qd dqd = 0
 *
 * and M dqdd + R_q dq + R_qd dqd = J' dlambda, R being the residual with lambda inside. X' takes dlambda out (X' J' =
 * 0) and leaves Mr dudd. Wehage and Haug 1982 for the partitioning; differentiation as in Fisette and Samin 1996,
 * sec. 4. */
#include "integrators/reduced_jacobian.h"
#include "base/memory.h"
#include <string.h>

kempe_status kmp_reduced_jacobian_init(kmp_reduced_jacobian *jacobian, kmp_reduction *red, bool power)
{
    int n = red->n, m = red->part->m;
    unsigned values = 1u << KMP_VALUE_R | 1u << KMP_VALUE_RATE | 1u << KMP_VALUE_CURVE;
    *jacobian = (kmp_reduced_jacobian){.red = red};
    jacobian->qdd = KMP_NEW(double, n);
    jacobian->lambda = KMP_NEW(double, m);
    jacobian->dq = KMP_NEW(double, n);
    jacobian->dqd = KMP_NEW(double, n);
    jacobian->da = KMP_NEW(double, n);
    jacobian->zero = KMP_NEW(double, n);
    jacobian->rows = KMP_NEW(double, m);
    jacobian->projected = KMP_NEW(double, n);
    if (!jacobian->qdd || !jacobian->lambda || !jacobian->dq || !jacobian->dqd || !jacobian->da || !jacobian->zero ||
        !jacobian->rows || !jacobian->projected)
        return kmp_fail_memory(red->plant->system->context);
    return kmp_tangents_init(&jacobian->tangents, red->plant->system, red->plant->backend,
                             values | (power ? 1u << KMP_VALUE_POWER : 0));
}

void kmp_reduced_jacobian_free(kmp_reduced_jacobian *jacobian)
{
    kmp_tangents_free(&jacobian->tangents);
    kmp_free(jacobian->qdd);
    kmp_free(jacobian->lambda);
    kmp_free(jacobian->dq);
    kmp_free(jacobian->dqd);
    kmp_free(jacobian->da);
    kmp_free(jacobian->zero);
    kmp_free(jacobian->rows);
    kmp_free(jacobian->projected);
    *jacobian = (kmp_reduced_jacobian){0};
}

/* out = (0; -Jv^-1 rows) for all m rows given. */
static void solve_v(const kmp_reduced_jacobian *jacobian, double *out)
{
    const kmp_reduction *red = jacobian->red;
    memset(out, 0, (size_t)red->n * sizeof *out);
    if (red->r == 0)
        return;
    for (int i = 0; i < red->r; i++)
        red->dv[i] = -jacobian->rows[red->part->rows[i]];
    kmp_block_solve(red->block, 1, red->dv);
    for (int i = 0; i < red->r; i++)
        out[red->part->v[i]] = red->dv[i];
}

static void clear_rows(kmp_reduced_jacobian *jacobian)
{
    memset(jacobian->rows, 0, (size_t)jacobian->red->part->m * sizeof *jacobian->rows);
}

/* What the motion (dq, dqd) takes from Mr udd, into `out` (p); `moving`: accelerations follow, otherwise they stay. */
static void pull(kmp_reduced_jacobian *jacobian, const double *d, const double *dq, const double *dqd, bool moving,
                 double *out)
{
    const kmp_tangents *t = &jacobian->tangents;
    kmp_reduction *red = jacobian->red;
    double *force = red->force;
    clear_rows(jacobian);
    kmp_tangents_add(t, KMP_CURVE_Q, d, 1, dq, jacobian->rows);
    kmp_tangents_add(t, KMP_CURVE_QD, d, 1, dqd, jacobian->rows);
    solve_v(jacobian, jacobian->da);
    memset(force, 0, (size_t)red->n * sizeof *force);
    kmp_tangents_add(t, KMP_R_Q, d, 1, dq, force);
    kmp_tangents_add(t, KMP_R_QD, d, 1, dqd, force);
    kmp_tangents_add(t, KMP_M, d, 1, jacobian->da, force);
    kmp_reduction_press_change(red, moving, force);
    kmp_reduction_project(red, force, out);
}

/* The column of u[k]: rates follow so that ud stays. */
static const double *move(kmp_reduced_jacobian *jacobian, const double *d, int k)
{
    const kmp_reduction *red = jacobian->red;
    memcpy(jacobian->dq, red->x + k * red->n, (size_t)red->n * sizeof(double));
    clear_rows(jacobian);
    kmp_tangents_add(&jacobian->tangents, KMP_RATE_Q, d, 1, jacobian->dq, jacobian->rows);
    solve_v(jacobian, jacobian->dqd);
    return jacobian->dqd;
}

/* Derivatives at (t, q, qd, udd), with the multipliers there. */
static const double *derive(kmp_reduced_jacobian *jacobian, double t, const double *q, const double *qd,
                            const double *udd)
{
    const kmp_plant *plant = jacobian->red->plant;
    kmp_reduction_accelerations(jacobian->red, udd, jacobian->qdd);
    kmp_reduction_multipliers(jacobian->red, jacobian->qdd, jacobian->lambda);
    kmp_instant at = {t, q, qd, jacobian->qdd, jacobian->lambda, NULL, plant->mode, plant->chart, plant->chart_version};
    return kmp_tangents_derivatives(&jacobian->tangents, &at);
}

void kmp_reduced_jacobian_eval(kmp_reduced_jacobian *jacobian, double t, const double *q, const double *qd,
                               const double *udd, int size, double *j)
{
    kmp_reduction *red = jacobian->red;
    const kmp_tangents *tangents = &jacobian->tangents;
    int p = red->p;
    const double *d = derive(jacobian, t, q, qd, udd);
    (void)kmp_reduction_press_factor(red, true); /* the state was come to with the same */
    for (int c = 0; c < 2 * p; c++) {
        const double *dq = c < p ? jacobian->dq : jacobian->zero;
        const double *dqd = c < p ? move(jacobian, d, c) : red->x + (c - p) * red->n;
        double *column = j + c * size;
        if (c >= p)
            column[c - p] = 1;
        pull(jacobian, d, dq, dqd, true, column + p);
        kmp_reduction_solve_mass(red, column + p);
        if (size > 2 * p) {
            kmp_tangents_add(tangents, KMP_POWER_Q, d, 1, dq, column + 2 * p);
            kmp_tangents_add(tangents, KMP_POWER_QD, d, 1, dqd, column + 2 * p);
        }
    }
}

/* d(M qdd + C - J' lambda) = 0 taken for itself: X' takes out what J' makes of the change of X. */
void kmp_reduced_jacobian_of_residual(kmp_reduced_jacobian *jacobian, double t, double cj, const double *q,
                                      const double *qd, const double *udd, int size, double *j)
{
    kmp_reduction *red = jacobian->red;
    const kmp_tangents *tangents = &jacobian->tangents;
    int p = red->p;
    const double *d = derive(jacobian, t, q, qd, udd);
    (void)kmp_reduction_press_factor(red, false);
    for (int c = 0; c < 2 * p; c++) {
        const double *dq = c < p ? jacobian->dq : jacobian->zero;
        const double *dqd = c < p ? move(jacobian, d, c) : red->x + (c - p) * red->n;
        double *column = j + c * size;
        column[c % p] = c < p ? cj : -1;
        pull(jacobian, d, dq, dqd, false, column + p);
        for (int k = 0; k < p; k++)
            column[p + k] = -column[p + k];
        if (size > 2 * p) {
            kmp_tangents_add(tangents, KMP_POWER_Q, d, -1, dq, column + 2 * p);
            kmp_tangents_add(tangents, KMP_POWER_QD, d, -1, dqd, column + 2 * p);
        }
        if (c < p)
            continue;
        memset(red->force, 0, (size_t)red->n * sizeof *red->force);
        kmp_tangents_add(tangents, KMP_M, d, -cj, red->x + (c - p) * red->n, red->force);
        kmp_reduction_press_change(red, false, red->force);
        kmp_reduction_project(red, red->force, jacobian->projected);
        for (int k = 0; k < p; k++)
            column[p + k] += jacobian->projected[k];
    }
    if (size > 2 * p)
        j[2 * p + 2 * p * size] = cj;
}
