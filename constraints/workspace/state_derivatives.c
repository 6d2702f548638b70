/* SPDX-License-Identifier: BSD-3-Clause */
/* Exact derivatives of accelerations and multipliers at a state of the public workspace, by the implicit-function
 * theorem on M qdd + C = Q + J' lambda and J qdd + jdqd = 0: each direction is one more solution with the factors of
 * the state. Along closed motions the change of all coordinates follows the change of the independent ones first
 * (constraints/partition/small_change.h). */
#include "constraints/evaluation/evaluator.h"
#include "constraints/partition/small_change.h"
#include "constraints/tolerances.h"
#include "constraints/workspace/state_workspace.h"
#include "model/data/model.h"
#include <string.h>

KMP_GETTER(int kempe_workspace_independent_count(const kempe_workspace *workspace), workspace,
           workspace->chosen ? workspace->part.p : 0, 0)
KMP_GETTER(const int *kempe_workspace_independent(const kempe_workspace *workspace), workspace,
           workspace->chosen ? workspace->part.u : NULL, NULL)

kempe_status kempe_workspace_add_derivatives(kempe_workspace *ws)
{
    KMP_WANTED(NULL, ws, "workspace");
    const kempe_system *s = ws->system;
    kmp_state_derivatives *d = &ws->derivatives;
    const int n = ws->n, m = ws->m;
    ws->message[0] = '\0';
    if (d->made)
        return KEMPE_OK;
    KMP_TRY(kmp_workspace_refuse_contacts(ws, "derivatives of forward dynamics"));
    if (s->load_row_count > 0) {
        (void)kmp_workspace_fail(ws,
                                 "there are no derivatives of forward dynamics for this model: a force depends on the "
                                 "multiplier of constraint equation '%s'",
                                 s->row_names[s->load_rows[0]]);
        return KEMPE_E_ARGUMENT;
    }
    KMP_TRY(kmp_made(s->context, KMP_ARENA_MAKE(&ws->arena, KMP_ROOM(double, n, &d->unit, &d->force, &d->x),
                                                KMP_ROOM(double, m, &d->curve, &d->a),
                                                KMP_ROOM(double, KMP_FOLLOW_ROOM(n, m), &d->room))));
    KMP_TRY(kmp_tangents_init(&d->tangents, s, ws->eval->backend, kmp_tangents_of_runs(s)));
    d->made = true;
    return KEMPE_OK;
}

/* -- in all coordinates ------------------------------------------------------------------------------ */

/* A row of derivatives by q, by qd or by Q: the blocks by which M qdd + C - J' lambda and J qdd + jdqd change. */
typedef struct direction {
    kmp_tangent_block force, curve;
    double *qdd, *lambda; /* NULL: not wanted */
    bool of_effort;       /* by Q: no block */
} direction;

static void put_column(double *matrix, int rows, int column, const double *values)
{
    if (matrix && rows > 0)
        memcpy(matrix + (ptrdiff_t)column * rows, values, (size_t)rows * sizeof *matrix);
}

/* Derivatives by each coordinate from the factors of the state. */
static void derive_all(kempe_workspace *ws, const double *tangents, bool reduced, const direction *by)
{
    kmp_state_derivatives *d = &ws->derivatives;
    for (int j = 0; (by->qdd || by->lambda) && j < ws->n; j++) {
        memset(d->force, 0, (size_t)ws->n * sizeof *d->force);
        memset(d->curve, 0, (size_t)ws->m * sizeof *d->curve);
        d->unit[j] = 1;
        if (by->of_effort) {
            d->force[j] = -1;
        } else {
            kmp_tangents_add(&d->tangents, by->force, tangents, 1, d->unit, d->force);
            kmp_tangents_add(&d->tangents, by->curve, tangents, 1, d->unit, d->curve);
        }
        d->unit[j] = 0;
        if (reduced)
            kmp_reduction_solve_saddle(&ws->red, d->force, d->curve, d->x, d->a);
        else
            kmp_saddle_solve(&ws->saddle, d->force, d->curve, d->x, d->a);
        put_column(by->qdd, ws->n, j, d->x);
        put_column(by->lambda, ws->m, j, d->a);
    }
}

/* -- along closed motions ---------------------------------------------------------------------------- */

/* udd from the change of the reduced residual in it. */
static void accelerate(const kempe_workspace *ws, double *udd)
{
    for (int k = 0; k < ws->part.p; k++)
        udd[k] = -udd[k];
    kmp_reduction_solve_mass(&ws->red, udd);
}

static double *column_of(double *matrix, int rows, int column)
{
    return matrix ? matrix + (ptrdiff_t)column * rows : NULL;
}

static void derive_closed(kempe_workspace *ws, const double *tangents, const kempe_workspace_derivatives *out)
{
    kmp_state_derivatives *d = &ws->derivatives;
    const int n = ws->n, p = ws->part.p;
    for (int k = 0; k < p; k++) {
        double *by_u = column_of(out->udd_u, p, k), *by_ud = column_of(out->udd_ud, p, k);
        d->unit[k] = 1;
        if (by_u || out->q_u || out->qd_u)
            kmp_follow(
                &ws->red, &d->tangents, tangents, false, &(kmp_change){.u = d->unit},
                &(kmp_response){.q = column_of(out->q_u, n, k), .qd = column_of(out->qd_u, n, k), .residual = by_u},
                d->room);
        if (by_ud)
            kmp_follow(&ws->red, &d->tangents, tangents, false, &(kmp_change){.ud = d->unit},
                       &(kmp_response){.residual = by_ud}, d->room);
        d->unit[k] = 0;
        if (by_u)
            accelerate(ws, by_u);
        if (by_ud)
            accelerate(ws, by_ud);
    }
    for (int j = 0; out->udd_Q && j < n; j++) {
        double *by_effort = column_of(out->udd_Q, p, j);
        for (int k = 0; k < p; k++)
            by_effort[k] = -ws->red.x[j + (ptrdiff_t)k * n];
        accelerate(ws, by_effort);
    }
}

/* -- the calls --------------------------------------------------------------------------------------- */

/* Fails if the loops are open: derivatives along closed motions would belong to none. */
static kempe_status require_closed(kempe_workspace *ws, double t)
{
    int row = 0;
    for (int r = 1; r < ws->m; r++)
        if (kmp_eval_opening(ws->eval, r) > kmp_eval_opening(ws->eval, row))
            row = r;
    if (ws->m == 0 || kmp_eval_residual(ws->eval) <= KMP_CLOSED_NEAR)
        return KEMPE_OK;
    return kmp_workspace_fail(ws,
                              "derivatives along closed motions need closed loops, but constraint equation '%s' is "
                              "open by %.3g (relative) at t = %.9g s: close the state first",
                              ws->system->row_names[row], kmp_eval_opening(ws->eval, row), t);
}

kempe_status kempe_workspace_forward_derivatives(kempe_workspace *ws, double t, const double *q, const double *qd,
                                                 const double *Q, double *qdd, double *lambda,
                                                 const kempe_workspace_derivatives *out)
{
    KMP_WANTED(NULL, ws, "workspace");
    if (!kmp_workspace_given(ws, "q", q) || !kmp_workspace_given(ws, "qd", qd) ||
        !kmp_workspace_given(ws, "qdd", qdd) || !kmp_workspace_given(ws, "out", out))
        return KEMPE_E_ARGUMENT;
    if (!ws->derivatives.made) {
        (void)kmp_workspace_fail(ws, "derivatives are not prepared: call kempe_workspace_add_derivatives first");
        return KEMPE_E_ARGUMENT;
    }
    bool reduced;
    KMP_TRY(kmp_workspace_solve(ws, t, q, qd, Q, &reduced));
    const bool closed = out->udd_u || out->udd_ud || out->udd_Q || out->q_u || out->qd_u;
    if (closed && !reduced)
        return kmp_workspace_fail(
            ws,
            "there are no derivatives by the independent coordinates at t = %.9g s, because these "
            "do not describe the motion there: take those by all coordinates",
            t);
    if (closed)
        KMP_TRY(require_closed(ws, t));
    const kmp_instant at = kmp_instant_of(ws->eval, t, ws->q, ws->qd, ws->answer, ws->answer + ws->n);
    const double *tangents = kmp_tangents_derivatives(&ws->derivatives.tangents, &at);
    const direction by[] = {{KMP_R_Q, KMP_CURVE_Q, out->qdd_q, out->lambda_q, false},
                            {KMP_R_QD, KMP_CURVE_QD, out->qdd_qd, out->lambda_qd, false},
                            {KMP_R_Q, KMP_CURVE_Q, out->qdd_Q, out->lambda_Q, true}};
    for (size_t k = 0; k < sizeof by / sizeof *by; k++)
        derive_all(ws, tangents, reduced, &by[k]);
    if (closed)
        derive_closed(ws, tangents, out);
    memcpy(qdd, ws->answer, (size_t)ws->n * sizeof *qdd);
    if (lambda)
        memcpy(lambda, ws->answer + ws->n, (size_t)ws->m * sizeof *lambda);
    return KEMPE_OK;
}

/* The places of a state in rows of `size` numbers each. */
static double *place_of(double *rows, int size, int state)
{
    return rows ? rows + (ptrdiff_t)size * state : NULL;
}

kempe_status kempe_workspace_derivative_states(kempe_workspace *ws, int count, const double *t, int t_step,
                                               const double *q, const double *qd, const double *Q, double *qdd,
                                               double *lambda, const kempe_workspace_derivatives *rows, int *failed)
{
    KMP_WANTED(NULL, ws, "workspace");
    if (!kmp_workspace_given(ws, "t", t) || !kmp_workspace_given(ws, "q", q) || !kmp_workspace_given(ws, "qd", qd) ||
        !kmp_workspace_given(ws, "qdd", qdd) || !kmp_workspace_given(ws, "rows", rows))
        return KEMPE_E_ARGUMENT;
    KMP_TRY(kmp_workspace_check_count(ws, count));
    const int n = ws->n, m = ws->m, p = kempe_workspace_independent_count(ws);
    kempe_status status = KEMPE_OK;
    int k = 0;
    for (; k < count && status == KEMPE_OK; k++) {
        const ptrdiff_t at = (ptrdiff_t)k * n;
        const kempe_workspace_derivatives out = {
            place_of(rows->qdd_q, n * n, k),    place_of(rows->qdd_qd, n * n, k),    place_of(rows->qdd_Q, n * n, k),
            place_of(rows->lambda_q, m * n, k), place_of(rows->lambda_qd, m * n, k), place_of(rows->lambda_Q, m * n, k),
            place_of(rows->udd_u, p * p, k),    place_of(rows->udd_ud, p * p, k),    place_of(rows->udd_Q, p * n, k),
            place_of(rows->q_u, n * p, k),      place_of(rows->qd_u, n * p, k)};
        status = kempe_workspace_forward_derivatives(ws, t[t_step ? k : 0], q + at, qd + at, Q ? Q + at : NULL,
                                                     qdd + at, place_of(lambda, m, k), &out);
    }
    if (failed)
        *failed = status == KEMPE_OK ? -1 : k - 1;
    return status;
}
