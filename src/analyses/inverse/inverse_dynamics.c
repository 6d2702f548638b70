/* SPDX-License-Identifier: BSD-3-Clause */
/* Least-squares solution of N' S tau = N' (M qdd + C) by a singular value decomposition in scaled orthonormal
 * coordinates. The multipliers follow from the remaining rows (Fisette and Samin 1996, eq. 44). */
#include "analyses/inverse/inverse_dynamics.h"
#include "analyses/inverse/kept_rows.h"
#include "analyses/parts/closed_state.h"
#include "base/memory.h"
#include "constraints/evaluation/evaluator.h"
#include "constraints/evaluation/load_multipliers.h"
#include "constraints/tolerances.h"
#include "linalg/dense/dot.h"
#include "model/data/closure.h"
#include "model/data/closure_table.h"
#include "model/data/coordinates.h"
#include "model/data/state.h"
#include "model/read/loads.h"
#include "output/print.h"
#include <math.h>
#include <string.h>

/* -- construction and release ------------------------------------------------------------------------ */

kempe_status kmp_inverse_init(kmp_inverse *inverse, kmp_evaluator *eval, int count, const int *actuator,
                              const double *weight)
{
    const kempe_system *s = eval->system;
    kmp_inverse *v = inverse;
    *v = (kmp_inverse){.system = s, .eval = eval, .n = s->n, .m = s->m, .a = count};
    ptrdiff_t n = v->n, pressed = s->load_row_count > 0 ? n : 0;
    if (!KMP_ARENA_MAKE(&v->arena, KMP_ROOM(int, v->a, &v->actuator), KMP_ROOM(bool, v->m, &v->left_out),
                        KMP_ROOM(double, v->a, &v->weight, &v->tau), KMP_ROOM(double, v->m, &v->lambda),
                        KMP_ROOM(double, s->events.count, &v->change), KMP_ROOM(double, s->jacobian.count, &v->masked),
                        KMP_ROOM(double, n, &v->rest, &v->sum), KMP_ROOM(double, pressed, &v->inertia))) {
        kmp_inverse_free(v);
        return kmp_fail_memory(s->context);
    }
    for (int k = 0; k < count; k++) {
        v->actuator[k] = actuator[k];
        v->weight[k] = weight ? weight[k] : 1;
    }
    for (int r = 0; r < s->m; r++) { /* a joint carries its load itself */
        const kmp_closure *closure = kmp_model_closure(s->model, s->rows[r].closure);
        v->left_out[r] = kmp_closure_is_drive(closure) && !kmp_motion_is_for_load(s->model, closure->motion);
    }
    for (int k = 0; k < s->load_row_count; k++)
        if (v->left_out[s->load_rows[k]]) {
            kmp_inverse_free(v);
            return kmp_fail(s->context, KEMPE_E_ARGUMENT,
                            "inverse dynamics: a force depends on the multiplier of '%s', a drive or a lock, which has "
                            "none here because actuators have its force; simulate the model with its drives",
                            kmp_model_closure(s->model, s->rows[s->load_rows[k]].closure)->name);
        }
    return KEMPE_OK;
}

static void forget_choice(kmp_inverse *v)
{
    kmp_arena_free(&v->choices);
    kmp_reduction_free(&v->red);
    kmp_partition_free(&v->part);
}

KMP_CLEARS(kmp_inverse, inverse, forget_choice(inverse), kmp_arena_free(&inverse->arena))

/* -- the choice of independent coordinates ----------------------------------------------------------- */

/* Factors Jv and computes N with the current choice; true if it is well conditioned. */
static bool tangent_is_good(kmp_inverse *v)
{
    int at_v, at_u;
    if (!v->red.eval || kmp_reduction_factor(&v->red))
        return false;
    kmp_reduction_tangent(&v->red);
    if (!(kmp_reduction_growth(&v->red, &at_v, &at_u) < KMP_EXCHANGE_LED))
        return false;
    /* The rows dropped from a loop must be satisfied along all motions that the others permit. */
    for (int k = 0; v->part.r < v->m && k < v->p; k++)
        if (!(kmp_reduction_slip(&v->red, k, v->left_out) * v->system->scale[v->part.u[k]] <= KMP_RANK_NOT_REDUNDANT))
            return false;
    return v->part.r == v->m || kmp_keeps_rows_well(&v->red, v->left_out, v->rest, v->lambda);
}

static kempe_status make_tangent(kmp_inverse *v, double t)
{
    if (tangent_is_good(v))
        return KEMPE_OK;
    /* Chooses coordinates at the evaluator's last closure. */
    forget_choice(v);
    kmp_eval_mask(v->eval, v->left_out, v->masked);
    KMP_TRY(kmp_partition_init(&v->part, v->system, v->masked, NULL, 0));
    int p = v->p = v->part.p;
    v->freedoms = p - kmp_model_state_count(v->system->model);
    if (!KMP_ARENA_MAKE(&v->choices, KMP_ROOM(double, p *p, &v->gram, &v->inner),
                        KMP_ROOM(double, p * v->a, &v->matrix), KMP_ROOM(double, p, &v->reach, &v->choice, &v->left)) ||
        !kmp_singular_init(&v->svd, &v->choices, p, v->a))
        return kmp_fail_memory(v->system->context);
    KMP_TRY(kmp_reduction_init(&v->red, v->eval, &v->part));
    if (kmp_reduction_factor(&v->red))
        return kmp_fail(v->system->context, KEMPE_E_FAILED, "the loops are singular at t = %.9g s", t);
    kmp_reduction_tangent(&v->red);
    return KEMPE_OK;
}

/* -- generalized forces ------------------------------------------------------------------------------ */

static double n_at(const kmp_inverse *v, int coordinate, int k)
{
    return v->red.x[coordinate + k * v->n];
}

/* |L^-1 x| of x by u in its own units. */
static double norm_of(kmp_inverse *v, const double *x)
{
    for (int k = 0; k < v->p; k++)
        v->choice[k] = x[k] * v->system->scale[v->part.u[k]];
    kmp_cholesky_forward(v->p, v->gram, v->choice);
    return sqrt(kmp_dot(v->p, v->choice, v->choice));
}

/* L of N'N = L L', and A = L^-1 N'S, scaled. */
static bool make_equations(kmp_inverse *v)
{
    const double *scale = v->system->scale;
    int n = v->n, p = v->p;
    for (int k = 0; k < p; k++)
        for (int i = k; i < p; i++) {
            double sum = 0;
            for (int c = 0; c < n; c++)
                sum += n_at(v, c, i) / scale[c] * (n_at(v, c, k) / scale[c]);
            v->gram[i + k * p] = sum * scale[v->part.u[i]] * scale[v->part.u[k]];
        }
    if (kmp_cholesky_factor(p, v->gram))
        return false;
    for (int j = 0; j < v->a; j++) {
        int c = v->actuator[j];
        for (int k = 0; k < p; k++)
            v->matrix[k + j * p] = n_at(v, c, k) * scale[v->part.u[k]] / scale[c];
        kmp_cholesky_forward(p, v->gram, v->matrix + j * p);
    }
    return true;
}

/* N' x by u, without the equations of states. */
static void project(const kmp_inverse *v, const double *x, double *out)
{
    const int coordinates = kmp_model_coordinates(v->system->model);
    for (int k = 0; k < v->p; k++)
        out[k] = v->part.u[k] < coordinates ? kmp_dot(v->n, v->red.x + k * v->n, x) : 0;
}

/* The residual of all n equations, relative to the sizes of their terms: |M qdd|, |C|, |J' lambda|, |S tau|. */
static void find_residual(kmp_inverse *v)
{
    const kempe_system *s = v->system;
    const kmp_pattern *j = &s->jacobian;
    double worst = 0, size = 0;
    for (int i = 0; i < v->n; i++) {
        double bias = v->eval->bias[i];
        v->sum[i] = fabs(v->red.force[i] - bias) + fabs(bias) + fabs(v->red.force[i] - v->rest[i]);
    }
    for (int e = 0; e < j->count; e++) {
        double x = v->eval->jacobian[e] * v->lambda[j->row[e]];
        v->rest[j->col[e]] -= x;
        v->sum[j->col[e]] += fabs(x);
    }
    for (int i = 0; i < kmp_model_coordinates(s->model); i++) {
        worst = fmax(worst, fabs(v->rest[i]) * s->scale[i]);
        size = fmax(size, v->sum[i] * s->scale[i]);
    }
    v->residual = size > 0 ? worst / size : 0;
}

/* tau for the reduced M qdd + C, in v->red.force. false: it is not finite. */
static bool find_efforts(kmp_inverse *v)
{
    project(v, v->red.force, v->reach);
    for (int k = 0; k < v->p; k++)
        v->reach[k] *= v->system->scale[v->part.u[k]];
    kmp_cholesky_forward(v->p, v->gram, v->reach);
    /* tau of least weighted norm with V' tau = g, g = S^-1 U' f over the rank: W^-1 V (V' W^-1 V)^-1 g. */
    const kmp_singular *svd = &v->svd;
    int r = v->rank, p = v->p, k = svd->k;
    double *g = v->choice;
    for (int i = 0; i < r; i++) {
        g[i] = kmp_dot(p, svd->u + i * p, v->reach) / svd->s[i];
        for (int l = 0; l <= i; l++) {
            double sum = 0;
            for (int j = 0; j < v->a; j++)
                sum += svd->vt[i + j * k] * svd->vt[l + j * k] / v->weight[j];
            v->inner[i + l * r] = sum;
        }
    }
    if (kmp_cholesky_factor(r, v->inner))
        return false;
    kmp_cholesky_solve(r, v->inner, g);
    for (int j = 0; j < v->a; j++) {
        double sum = 0;
        for (int i = 0; i < r; i++)
            sum += svd->vt[i + j * k] * g[i];
        v->tau[j] = sum / v->weight[j] / v->system->scale[v->actuator[j]];
    }
    return true;
}

/* For forces that depend on multipliers: the multipliers that belong to the actuators' generalized forces. */
static void answer(void *self, const double *bias, bool change, double *lambda)
{
    kmp_inverse *v = self;
    double *force = v->red.force;
    for (int i = 0; i < v->n; i++)
        v->rest[i] = force[i] = bias[i] + (change ? 0 : v->inertia[i]);
    bool found = find_efforts(v);
    for (int j = 0; j < v->a; j++)
        v->rest[v->actuator[j]] -= found ? v->tau[j] : NAN;
    kmp_reduction_pull(&v->red, v->rest, v->lambda); /* of M qdd + C - S tau */
    memcpy(lambda, v->lambda, (size_t)v->m * sizeof *lambda);
}

/* C at the multipliers that the efforts leave. */
static bool press(kmp_inverse *v)
{
    if (v->system->load_row_count == 0)
        return true;
    for (int i = 0; i < v->n; i++)
        v->inertia[i] = v->red.force[i] - v->eval->bias[i];
    const kmp_answer with_efforts = {v, answer};
    bool settled = kmp_load_settle(v->eval, &with_efforts);
    for (int i = 0; i < v->n; i++)
        v->red.force[i] = v->eval->bias[i] + v->inertia[i];
    return settled;
}

static kempe_status fail_at(const kmp_inverse *v, double t)
{
    return kmp_fail(v->system->context, KEMPE_E_FAILED, "the equations are not finite at t = %.9g s", t);
}

kempe_status kmp_inverse_at(kmp_inverse *inverse, double t, const double *q, const double *qd, const double *qdd)
{
    kmp_inverse *v = inverse;
    kmp_eval_closure(v->eval, t, q);
    KMP_TRY(make_tangent(v, t));
    kmp_eval_mass(v->eval);
    kmp_eval_bias(v->eval, qd);
    for (int k = 0; k < v->p; k++)
        v->choice[k] = qdd[v->part.u[k]];
    kmp_reduction_residual(&v->red, v->choice, v->reach);
    if (kmp_is_unsettled(v->eval))
        return kmp_fail_unsettled(v->eval);
    if (!make_equations(v) || !kmp_singular_decompose(&v->svd, v->matrix))
        return fail_at(v, t);
    /* The rank, and the smallest singular value of all degrees of freedom. */
    const kmp_singular *svd = &v->svd;
    v->rank = 0;
    while (v->rank < svd->k && svd->s[v->rank] > KMP_RANK_ACTUATORS)
        v->rank++;
    const int p = v->freedoms;
    v->hold = p > 0 && p <= svd->k ? svd->s[p - 1] : p == 0 ? 1 : 0;
    if (!press(v))
        return kmp_fail_unsettled(v->eval);
    if (!find_efforts(v))
        return fail_at(v, t);
    /* The reduced equations: sizes of C and M qdd, the remainder without tau; then lambda. */
    project(v, v->eval->bias, v->left);
    double bias = norm_of(v, v->left);
    for (int i = 0; i < v->n; i++)
        v->rest[i] = v->red.force[i] - v->eval->bias[i];
    project(v, v->rest, v->left);
    v->size = bias + norm_of(v, v->left);
    memcpy(v->rest, v->red.force, (size_t)v->n * sizeof *v->rest);
    for (int j = 0; j < v->a; j++)
        v->rest[v->actuator[j]] -= v->tau[j];
    project(v, v->rest, v->left);
    v->unmet = norm_of(v, v->left);
    kmp_reduction_pull(&v->red, v->rest, v->lambda); /* of M qdd + C - S tau */
    find_residual(v);
    if (kmp_model_friction_count(v->system->model) > 0)
        kmp_eval_show_friction(v->eval, t, q, qd, qdd, v->lambda, v->change);
    return isfinite(v->unmet) && isfinite(v->residual) ? KEMPE_OK : fail_at(v, t);
}
