/* SPDX-License-Identifier: BSD-3-Clause */
/* A motion with sensitivities as a state: predicted from the nearer of two anchors along tangent and curvature, closed
 * by Newton's method, and differentiated there. Matrices are those of the linear equations at the state. */
#include "analyses/derivatives/varied.h"
#include "base/memory.h"
#include "constraints/closing/close.h"
#include "constraints/evaluation/charts.h"
#include "constraints/evaluation/evaluator.h"
#include "constraints/tolerances.h"
#include "model/data/model.h"
#include <math.h>
#include <string.h>

static bool make_room(kmp_sensitivity_equations *v)
{
    int n = v->n;
    return KMP_ARENA_MAKE(&v->arena,
                          KMP_ROOM(double, n, &v->q, &v->udd, &v->residual, &v->anchor[0].q, &v->anchor[1].q),
                          KMP_ROOM(double, n *(2 + n), &v->anchor[0].drift, &v->anchor[1].drift),
                          KMP_ROOM(double, 3 * v->m + n, &v->part), KMP_ROOM(double, v->slopes->shown, &v->shown));
}

kempe_status kmp_sensitivity_equations_init(kmp_sensitivity_equations *varied, const kempe_system *system,
                                            const char *backend, kmp_slopes *slopes)
{
    *varied = (kmp_sensitivity_equations){
        .system = system, .slopes = slopes, .n = system->n, .m = system->m, .count = slopes->count};
    kempe_status status = kmp_linear_init(&varied->linear, system, backend);
    if (status == KEMPE_OK && !make_room(varied))
        status = kmp_fail_memory(system->context);
    if (status != KEMPE_OK)
        kmp_sensitivity_equations_free(varied);
    return status;
}

KMP_CLEARS(kmp_sensitivity_equations, varied, kmp_linear_free(&varied->linear), kmp_arena_free(&varied->arena))

/* -- the state --------------------------------------------------------------------------------------- */

/* Anchors without a tangent. */
static void stand_alone(kmp_sensitivity_equations *v, double t, const double *q)
{
    for (int k = 0; k < 2; k++) {
        kmp_sensitivity_equations_place *at = &v->anchor[k];
        at->t = t;
        memcpy(at->q, q, (size_t)v->n * sizeof *q);
        memset(at->drift, 0, (size_t)(v->n * (2 + v->linear.p)) * sizeof *q);
    }
}

kempe_status kmp_sensitivity_equations_choose(kmp_sensitivity_equations *varied, double t, const double *q,
                                              const double *qd, const int *wish, int wish_count)
{
    kmp_linear *l = &varied->linear;
    KMP_TRY(kmp_linear_choose(l, t, q, wish, wish_count));
    if (!l->held)
        kmp_eval_freeze(l->eval, t, q, qd);
    l->held = true;
    stand_alone(varied, t, q);
    return KEMPE_OK;
}

kempe_status kmp_sensitivity_equations_take(kmp_sensitivity_equations *varied, double t, const double *q,
                                            kmp_partition *part)
{
    kempe_status status = kmp_linear_take(&varied->linear, part);
    if (status == KEMPE_OK)
        stand_alone(varied, t, q);
    return status;
}

void kmp_sensitivity_equations_anchor(kmp_sensitivity_equations *varied)
{
    const kmp_linear *l = &varied->linear;
    kmp_sensitivity_equations_place *at = varied->anchor, last = at[0];
    at[0] = at[1];
    at[1] = last;
    memcpy(at->q, l->q, (size_t)varied->n * sizeof *l->q);
    memcpy(at->drift, l->red.x_t, (size_t)varied->n * sizeof *l->q);
    memcpy(at->drift + varied->n, l->red.a0, (size_t)varied->n * sizeof *l->q);
    memcpy(at->drift + 2 * varied->n, l->red.x, (size_t)(varied->n * l->p) * sizeof *l->q);
    at->t = l->t;
}

/* Predicts along the tangent, with its curvature. */
static void predict_from(kmp_sensitivity_equations *v, const kmp_sensitivity_equations_place *at, double t,
                         const double *u)
{
    const kmp_partition *part = &v->linear.part;
    const double *curve = at->drift + v->n, *x = curve + v->n;
    double tau = t - at->t;
    for (int i = 0; i < v->n; i++)
        v->q[i] = at->q[i] + tau * (at->drift[i] + 0.5 * tau * curve[i]);
    for (int k = 0; k < part->p; k++) {
        double du = u[k] - at->q[part->u[k]];
        for (int i = 0; i < v->n; i++)
            v->q[i] += x[i + k * v->n] * du;
    }
    for (int k = 0; k < part->p; k++)
        v->q[part->u[k]] = u[k];
}

/* Predicts from the nearer anchor. */
static void predict(kmp_sensitivity_equations *v, double t, const double *u)
{
    predict_from(v, &v->anchor[fabs(t - v->anchor[1].t) < fabs(t - v->anchor[0].t)], t, u);
}

double kmp_sensitivity_equations_miss(kmp_sensitivity_equations *varied, const double *u)
{
    const kmp_linear *l = &varied->linear;
    double most = 0;
    predict_from(varied, &varied->anchor[0], l->t, u);
    for (int i = 0; i < varied->n; i++)
        most = fmax(most, fabs(l->q[i] - varied->q[i]) / varied->system->scale[i]);
    return most;
}

int kmp_sensitivity_equations_position(kmp_sensitivity_equations *varied, double t, const double *u, double *q)
{
    predict(varied, t, u);
    if (kmp_reduction_close(&varied->linear.red, t, varied->q, NULL, 0))
        return KMP_RETRY;
    memcpy(q, varied->q, (size_t)varied->n * sizeof *q);
    return KMP_GO;
}

int kmp_sensitivity_equations_at(kmp_sensitivity_equations *varied, double t, const double *u, const double *ud)
{
    predict(varied, t, u);
    return kmp_sensitivity_equations_near(varied, t, varied->q, ud);
}

int kmp_sensitivity_equations_near(kmp_sensitivity_equations *varied, double t, const double *q, const double *ud)
{
    kmp_linear *l = &varied->linear;
    if (kmp_linear_at_motion(l, t, q, ud) != KEMPE_OK)
        return KMP_RETRY;
    for (int i = 0; i < varied->n; i++)
        if (!isfinite(l->qdd[i]))
            return KMP_RETRY;
    if (l->plain || varied->count == 0)
        return KMP_GO;
    kmp_instant at = kmp_linear_instant(l);
    kmp_slopes_at(varied->slopes, &at);
    return KMP_GO;
}

void kmp_sensitivity_equations_matrix(kmp_sensitivity_equations *varied, double *matrix)
{
    kmp_linear *l = &varied->linear;
    int p = l->p;
    double *unit = varied->udd;
    memset(unit, 0, (size_t)p * sizeof *unit);
    for (int c = 0; c < 2 * p; c++) {
        double *column = matrix + c * p;
        unit[c % p] = 1;
        kmp_change change = {.u = c < p ? unit : NULL, .ud = c < p ? NULL : unit};
        kmp_linear_follow(l, &change, &(kmp_response){.residual = column});
        kmp_linear_accelerate(l, column, column);
        unit[c % p] = 0;
    }
}

const char *kmp_sensitivity_equations_singular(const kmp_sensitivity_equations *varied)
{
    const kempe_system *s = varied->system;
    for (int c = 0; c < kmp_charts_count(s); c++)
        if (kmp_chart_regular(s, c, varied->linear.q) < KMP_AXES_LOST)
            return s->model->bodies[s->model->motions[s->chart_first[c]].body].joint;
    return NULL;
}

/* -- parameters -------------------------------------------------------------------------------------- */

static kmp_change change_by(kmp_sensitivity_equations *v, int k, const double *u, const double *ud)
{
    kmp_change change = kmp_slopes_change(v->slopes, k, v->part);
    change.u = u;
    change.ud = ud;
    return change;
}

static void accelerate(kmp_sensitivity_equations *v, const kmp_change *change, double *sudd)
{
    kmp_linear_follow(&v->linear, change, &(kmp_response){.residual = v->residual});
    kmp_linear_accelerate(&v->linear, v->residual, sudd);
}

void kmp_sensitivity_equations_accelerate(kmp_sensitivity_equations *varied, int k, const double *su, const double *sud,
                                          double *sudd)
{
    kmp_change change = change_by(varied, k, su, sud);
    accelerate(varied, &change, sudd);
}

void kmp_sensitivity_equations_follow(kmp_sensitivity_equations *varied, int k, const double *su, const double *sud,
                                      double *q, double *qd, double *qdd, double *lambda)
{
    kmp_change change = change_by(varied, k, su, sud);
    if (qdd || lambda) {
        accelerate(varied, &change, varied->udd);
        change.udd = varied->udd;
    }
    kmp_linear_follow(&varied->linear, &change, &(kmp_response){q, qd, qdd, lambda, NULL});
}
