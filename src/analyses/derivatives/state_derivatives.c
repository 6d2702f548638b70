/* SPDX-License-Identifier: BSD-3-Clause */
/* Exact derivatives of accelerations and multipliers at a state of the public workspace, by the implicit-function
 * theorem on M qdd + C = Q + J' lambda and J qdd + jdqd = 0: each direction is one more solution with the factors of
 * the state. Along closed motions the change of all coordinates follows the change of the independent ones first
 * (constraints/partition/small_change.h). */
#include "analyses/derivatives/parameter_slopes.h"
#include "base/context.h"
#include "base/memory.h"
#include "constraints/evaluation/evaluator.h"
#include "constraints/inexact/nearest_exact.h"
#include "constraints/partition/small_change.h"
#include "constraints/tolerances.h"
#include "constraints/workspace/state_workspace.h"
#include "model/data/model.h"
#include "model/data/variant.h"
#include <kempe/derivatives.h>
#include <string.h>

/* Derivatives of the equations, and work space. */
typedef struct kmp_state_derivatives {
    kmp_arena arena;
    kmp_tangents tangents;
    double *unit, *force, *curve; /* n, n, m: a direction, and the changes of M qdd + C - J' lambda and J qdd + jdqd */
    double *x, *a;                /* n, m: changes of qdd and lambda */
    double *room;                 /* KMP_FOLLOW_ROOM */
    double *part;                 /* 3 m + n: the change of the equations by a name */
    int names;                    /* inputs and parameters by which derivatives are taken, too */
    kmp_variant *variant;         /* in which the parameters among them vary, */
    kempe_system *varied;         /* and its system; NULL: all names are inputs */
    kmp_slopes *slopes;           /* NULL: no names */
} kmp_state_derivatives;

/* -- preparation ------------------------------------------------------------------------------------- */

static void release_names(kmp_state_derivatives *d)
{
    kmp_slopes_free(d->slopes);
    kempe_system_free(d->varied);
    kmp_variant_free(d->variant);
    d->slopes = NULL, d->varied = NULL, d->variant = NULL, d->names = 0;
}

static void free_derivatives(void *self)
{
    kmp_state_derivatives *d = self;
    release_names(d);
    kmp_tangents_free(&d->tangents);
    kmp_arena_free(&d->arena);
    kmp_free(d);
}

static kempe_status refuse(kempe_workspace *ws)
{
    const kempe_system *s = ws->system;
    KMP_TRY(kmp_workspace_refuse_contacts(ws, "derivatives of the equations of motion"));
    if (s->load_row_count == 0)
        return KEMPE_OK;
    (void)kmp_workspace_fail(ws,
                             "derivatives of the equations of motion do not exist for this model, because a force "
                             "depends on the multiplier of constraint equation '%s'",
                             s->row_names[s->load_rows[0]]);
    return KEMPE_E_ARGUMENT;
}

static kempe_status add_tangents(kempe_workspace *ws)
{
    const kempe_system *s = ws->system;
    const int n = ws->n, m = ws->m;
    KMP_MAKE(s->context, kmp_state_derivatives, d);
    ws->derivatives = (kmp_workspace_part){d, free_derivatives};
    KMP_TRY(kmp_made(s->context, KMP_ARENA_MAKE(&d->arena, KMP_ROOM(double, n, &d->unit, &d->force, &d->x),
                                                KMP_ROOM(double, m, &d->curve, &d->a),
                                                KMP_ROOM(double, KMP_FOLLOW_ROOM(n, m), &d->room),
                                                KMP_ROOM(double, 3 * m + n, &d->part))));
    return kmp_tangents_init(&d->tangents, s, ws->eval->backend, kmp_tangents_of_runs(s));
}

static bool is_input(const kempe_model *model, const char *name)
{
    for (int k = 0; k < model->input_count; k++)
        if (strcmp(model->inputs[k].name, name) == 0)
            return true;
    return false;
}

/* A system in which the parameters among the names vary, with the coordinates, rows and conditions of the workspace. */
static kempe_status vary(kempe_workspace *ws, kmp_state_derivatives *d, int count, const char *const *names)
{
    const kempe_system *s = ws->system;
    const char **parameter = KMP_NEW(const char *, count);
    kempe_status status = kmp_made(s->context, parameter);
    int parameters = 0;
    for (int k = 0; parameter && k < count; k++)
        if (!is_input(s->model, names[k]))
            parameter[parameters++] = names[k];
    if (status == KEMPE_OK && parameters > 0)
        status = kmp_variant_new(s->model, parameters, parameter, &d->variant);
    if (status == KEMPE_OK && parameters > 0)
        status = kmp_system_of_variant(d->variant, &d->varied);
    if (status == KEMPE_OK && d->varied &&
        (d->varied->n != s->n || d->varied->m != s->m || d->varied->events.count != s->events.count))
        status = kmp_fail(s->context, KEMPE_E_ARGUMENT,
                          "derivatives by '%s' do not exist: conditions or constraint equations of the model depend on "
                          "its value",
                          parameter[0]);
    kmp_free(parameter);
    return status;
}

static kempe_status add_names(kempe_workspace *ws, int count, const char *const *names)
{
    const kempe_system *s = ws->system;
    kmp_state_derivatives *d = ws->derivatives.self;
    release_names(d);
    for (int k = 0; k < count; k++)
        for (int before = 0; before <= k; before++)
            if (!names[k] || (before < k && strcmp(names[before], names[k]) == 0)) {
                (void)kmp_workspace_fail(ws, names[k] ? "'%s' is given twice" : "a name is NULL", names[k]);
                return KEMPE_E_ARGUMENT;
            }
    kempe_status status = count > 0 ? vary(ws, d, count, names) : KEMPE_OK;
    if (status == KEMPE_OK && count > 0)
        status = kmp_slopes_new(d->varied ? d->varied : s, ws->eval->backend->name, count, names, false, &d->slopes);
    if (status != KEMPE_OK) {
        release_names(d);
        (void)kmp_workspace_fail(ws, "%s", kempe_context_message(s->context));
        return status;
    }
    d->names = count;
    return KEMPE_OK;
}

kempe_status kempe_workspace_add_derivatives(kempe_workspace *ws, int count, const char *const *names)
{
    KMP_WANTED(NULL, ws, "workspace");
    ws->message[0] = '\0';
    kmp_context_clear(ws->system->context);
    if (count < 0 || (count > 0 && !kmp_workspace_given(ws, "names", names)))
        return KEMPE_E_ARGUMENT;
    KMP_TRY(refuse(ws));
    if (!ws->derivatives.self) {
        const kempe_status status = add_tangents(ws);
        if (status != KEMPE_OK && ws->derivatives.self) {
            free_derivatives(ws->derivatives.self);
            ws->derivatives.self = NULL;
        }
        KMP_TRY(status);
    }
    return add_names(ws, count, names);
}

int kempe_workspace_name_count(const kempe_workspace *ws)
{
    const kmp_state_derivatives *d = ws ? ws->derivatives.self : NULL;
    return d ? d->names : 0;
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
    kmp_state_derivatives *d = ws->derivatives.self;
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

/* Derivatives by each named input and parameter. */
static void derive_names(kempe_workspace *ws, bool reduced, const kempe_workspace_derivatives *out)
{
    kmp_state_derivatives *d = ws->derivatives.self;
    for (int k = 0; (out->qdd_p || out->lambda_p) && k < d->names; k++) {
        const kmp_change change = kmp_slopes_change(d->slopes, k, d->part);
        if (reduced)
            kmp_reduction_solve_saddle(&ws->red, change.force, change.curve, d->x, d->a);
        else
            kmp_saddle_solve(&ws->saddle, change.force, change.curve, d->x, d->a);
        put_column(out->qdd_p, ws->n, k, d->x);
        put_column(out->lambda_p, ws->m, k, d->a);
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
    kmp_state_derivatives *d = ws->derivatives.self;
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
    for (int k = 0; (out->udd_p || out->q_p || out->qd_p) && k < d->names; k++) {
        const kmp_change change = kmp_slopes_change(d->slopes, k, d->part);
        double *by_name = column_of(out->udd_p, p, k);
        kmp_follow(
            &ws->red, &d->tangents, tangents, false, &change,
            &(kmp_response){.q = column_of(out->q_p, n, k), .qd = column_of(out->qd_p, n, k), .residual = by_name},
            d->room);
        if (by_name)
            accelerate(ws, by_name);
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

static kempe_status require_prepared(kempe_workspace *ws)
{
    if (ws->derivatives.self)
        return KEMPE_OK;
    (void)kmp_workspace_fail(ws, "derivatives are not prepared: call kempe_workspace_add_derivatives first");
    return KEMPE_E_ARGUMENT;
}

kempe_status kempe_workspace_forward_derivatives(kempe_workspace *ws, double t, const double *q, const double *qd,
                                                 const double *Q, double *qdd, double *lambda,
                                                 const kempe_workspace_derivatives *out)
{
    KMP_WANTED(NULL, ws, "workspace");
    if (!kmp_workspace_given(ws, "q", q) || !kmp_workspace_given(ws, "qd", qd) ||
        !kmp_workspace_given(ws, "qdd", qdd) || !kmp_workspace_given(ws, "out", out))
        return KEMPE_E_ARGUMENT;
    KMP_TRY(require_prepared(ws));
    kmp_state_derivatives *d = ws->derivatives.self;
    bool reduced;
    KMP_TRY(kmp_workspace_solve(ws, t, q, qd, Q, &reduced));
    const bool closed =
        out->udd_u || out->udd_ud || out->udd_Q || out->q_u || out->qd_u || out->udd_p || out->q_p || out->qd_p;
    if (closed && !reduced)
        return kmp_workspace_fail(
            ws,
            "derivatives by the independent coordinates do not exist at t = %.9g s, because these coordinates "
            "do not describe the motion there: take the derivatives by all coordinates",
            t);
    if (closed)
        KMP_TRY(require_closed(ws, t));
    const kmp_instant at = kmp_instant_of(ws->eval, t, ws->q, ws->qd, ws->answer, ws->answer + ws->n);
    const double *tangents = kmp_tangents_derivatives(&d->tangents, &at);
    if (d->slopes)
        kmp_slopes_at(d->slopes, &at);
    const direction by[] = {{KMP_R_Q, KMP_CURVE_Q, out->qdd_q, out->lambda_q, false},
                            {KMP_R_QD, KMP_CURVE_QD, out->qdd_qd, out->lambda_qd, false},
                            {KMP_R_Q, KMP_CURVE_Q, out->qdd_Q, out->lambda_Q, true}};
    for (size_t k = 0; k < sizeof by / sizeof *by; k++)
        derive_all(ws, tangents, reduced, &by[k]);
    derive_names(ws, reduced, out);
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
    const int n = ws->n, m = ws->m, p = kempe_workspace_independent_count(ws), names = kempe_workspace_name_count(ws);
    kempe_status status = KEMPE_OK;
    int k = 0;
    for (; k < count && status == KEMPE_OK; k++) {
        const ptrdiff_t at = (ptrdiff_t)k * n;
        const kempe_workspace_derivatives out = {
            place_of(rows->qdd_q, n * n, k),        place_of(rows->qdd_qd, n * n, k),
            place_of(rows->qdd_Q, n * n, k),        place_of(rows->lambda_q, m * n, k),
            place_of(rows->lambda_qd, m * n, k),    place_of(rows->lambda_Q, m * n, k),
            place_of(rows->udd_u, p * p, k),        place_of(rows->udd_ud, p * p, k),
            place_of(rows->udd_Q, p * n, k),        place_of(rows->q_u, n * p, k),
            place_of(rows->qd_u, n * p, k),         place_of(rows->qdd_p, n * names, k),
            place_of(rows->lambda_p, m * names, k), place_of(rows->udd_p, p * names, k),
            place_of(rows->q_p, n * names, k),      place_of(rows->qd_p, n * names, k)};
        status = kempe_workspace_forward_derivatives(ws, t[t_step ? k : 0], q + at, qd + at, Q ? Q + at : NULL,
                                                     qdd + at, place_of(lambda, m, k), &out);
    }
    if (failed)
        *failed = status == KEMPE_OK ? -1 : k - 1;
    return status;
}

/* -- inverse dynamics -------------------------------------------------------------------------------- */

kempe_status kempe_workspace_inverse_derivatives(kempe_workspace *ws, double t, const double *q, const double *qd,
                                                 const double *qdd, double *Q, const kempe_inverse_derivatives *out)
{
    KMP_WANTED(NULL, ws, "workspace");
    if (!kmp_workspace_given(ws, "out", out))
        return KEMPE_E_ARGUMENT;
    KMP_TRY(require_prepared(ws));
    KMP_TRY(kempe_workspace_inverse_dynamics(ws, t, q, qd, qdd, Q));
    kmp_state_derivatives *d = ws->derivatives.self;
    const int n = ws->n;
    memset(d->a, 0, (size_t)ws->m * sizeof *d->a); /* the loops are open: no multipliers */
    memcpy(d->x, qdd, (size_t)n * sizeof *d->x);
    const kmp_instant at = kmp_instant_of(ws->eval, t, ws->q, ws->qd, d->x, d->a);
    const double *tangents = kmp_tangents_derivatives(&d->tangents, &at);
    double *const by[] = {out->Q_q, out->Q_qd, out->Q_qdd};
    static const kmp_tangent_block block[] = {KMP_R_Q, KMP_R_QD, KMP_M};
    for (int k = 0; k < 3; k++)
        for (int j = 0; by[k] && j < n; j++) {
            memset(by[k] + (ptrdiff_t)j * n, 0, (size_t)n * sizeof **by);
            d->unit[j] = 1;
            kmp_tangents_add(&d->tangents, block[k], tangents, 1, d->unit, by[k] + (ptrdiff_t)j * n);
            d->unit[j] = 0;
        }
    if (out->Q_p && d->slopes)
        kmp_slopes_at(d->slopes, &at);
    for (int k = 0; out->Q_p && k < d->names; k++)
        put_column(out->Q_p, n, k, kmp_slopes_change(d->slopes, k, d->part).force);
    return KEMPE_OK;
}
