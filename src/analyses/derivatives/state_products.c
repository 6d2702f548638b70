/* SPDX-License-Identifier: BSD-3-Clause */
/* Products of the derivatives at a state with vectors, without the matrices: along a direction, one solution of the
 * saddle system with the change of the equations; of weights, one solution with the weights, because the system is
 * symmetric but for a sign, and products with the transposed derivatives of the equations. Second derivatives along two
 * directions are one more solution, with the second derivatives of the equations along both. */
#include "analyses/derivatives/state_derivatives.h"
#include "base/context.h"
#include "constraints/evaluation/load_multipliers.h"
#include "constraints/evaluation/tangent.h"
#include "linalg/dense/dot.h"
#include <string.h>

kempe_status kmp_derivatives_refuse_both(kempe_workspace *ws, bool all, bool closed)
{
    if (!all || !closed)
        return KEMPE_OK;
    return KMP_WORKSPACE_REFUSE(ws, "q and qd change with u and ud: give changes of all coordinates, or of the "
                                    "independent ones");
}

static bool given(kempe_workspace *ws, const double *q, const double *qd, const void *direction)
{
    return kmp_workspace_given(ws, "q", q) && kmp_workspace_given(ws, "qd", qd) &&
           kmp_workspace_given(ws, "direction", direction);
}

/* -- numbers that are not finite ------------------------------------------------------------------------ */

static const char *name_of(const kempe_workspace *ws, int entry)
{
    const kmp_state_derivatives *d = ws->derivatives.self;
    return d->name[entry];
}

kempe_status kmp_derivatives_check_direction(kempe_workspace *ws, const kempe_state_direction *direction)
{
    const int n = ws->n, p = kempe_workspace_independent_count(ws), names = kempe_workspace_name_count(ws);
    const struct {
        const char *what;
        kmp_entry_name *name;
        int count;
        const double *x;
    } part[] = {{"the change of q of", kmp_workspace_coordinate_name, n, direction->q},
                {"the change of qd of", kmp_workspace_coordinate_name, n, direction->qd},
                {"the change of Q of", kmp_workspace_coordinate_name, n, direction->Q},
                {"the change of", name_of, names, direction->p},
                {"the change of u of", kmp_workspace_independent_name, p, direction->u},
                {"the change of ud of", kmp_workspace_independent_name, p, direction->ud}};
    for (size_t k = 0; k < sizeof part / sizeof *part; k++)
        KMP_TRY(kmp_workspace_check_finite(ws, part[k].what, part[k].name, part[k].count, part[k].x));
    return KEMPE_OK;
}

kempe_status kmp_derivatives_check_weights(kempe_workspace *ws, const kempe_forward_values *weight)
{
    KMP_TRY(kmp_workspace_check_finite(ws, "the weight of qdd of", kmp_workspace_coordinate_name, ws->n, weight->qdd));
    KMP_TRY(kmp_workspace_check_finite(ws, "the weight of q of", kmp_workspace_coordinate_name, ws->n, weight->q));
    KMP_TRY(kmp_workspace_check_finite(ws, "the weight of qd of", kmp_workspace_coordinate_name, ws->n, weight->qd));
    KMP_TRY(kmp_workspace_check_finite(ws, "the weight of lambda of", kmp_workspace_row_name, ws->m, weight->lambda));
    return kmp_workspace_check_finite(ws, "the weight of output", kempe_workspace_output_name,
                                      kempe_workspace_output_count(ws), weight->y);
}

/* -- directions --------------------------------------------------------------------------------------- */

static void put_values(const kempe_workspace *ws, const kmp_derivative_point *point, const kempe_forward_values *value)
{
    if (!value)
        return;
    kmp_copy_wanted(ws->n, ws->answer, value->qdd);
    kmp_copy_wanted(ws->m, ws->answer + ws->n, value->lambda);
    kmp_copy_wanted(ws->n, ws->q, value->q);
    kmp_copy_wanted(ws->n, ws->qd, value->qd);
    kmp_derivatives_outputs(ws, point, value->y);
}

kempe_status kempe_workspace_forward_jvp(kempe_workspace *ws, double t, const double *q, const double *qd,
                                         const double *Q, const kempe_state_direction *direction,
                                         const kempe_forward_values *value, const kempe_forward_values *change)
{
    KMP_WANTED(NULL, ws, "workspace");
    if (!given(ws, q, qd, direction) || !kmp_workspace_given(ws, "change", change))
        return KEMPE_E_ARGUMENT;
    const bool closed = direction->u || direction->ud;
    KMP_TRY(kmp_derivatives_refuse_both(ws, direction->q || direction->qd, closed));
    KMP_TRY(kmp_derivatives_prepared(ws));
    KMP_TRY(kmp_derivatives_check_direction(ws, direction));
    kmp_derivative_point point;
    KMP_TRY(kmp_derivative_point_take(ws, t, q, qd, Q, closed, &point));
    kmp_state_derivatives *d = ws->derivatives.self;
    kmp_state_change along = {direction->q, direction->qd, direction->Q, direction->p, -1};
    if (closed) {
        kmp_derivatives_follow(ws, &point, direction->u, direction->ud, &along, NULL);
        along.q = d->dq;
        along.qd = d->dqd;
    }
    kmp_derivatives_respond(ws, &point, &along);
    kmp_copy_wanted(ws->n, d->x, change->qdd);
    kmp_copy_wanted(ws->m, d->a, change->lambda);
    kmp_derivatives_of_outputs(ws, &along, change->y);
    if (change->q)
        kmp_copy_or_zero(ws->n, along.q, change->q);
    if (change->qd)
        kmp_copy_or_zero(ws->n, along.qd, change->qd);
    put_values(ws, &point, value);
    return KEMPE_OK;
}

/* -- weights ----------------------------------------------------------------------------------------- */

/* M x - J' a = w of qdd, J x = -(w of lambda): then -x and a weigh the changes of both equations; in d->force, d->a. */
static void weigh_both(kempe_workspace *ws, const kmp_derivative_point *point, const double *by_qdd,
                       const double *by_lambda)
{
    kmp_state_derivatives *d = ws->derivatives.self;
    for (int i = 0; i < ws->n; i++)
        d->force[i] = -by_qdd[i];
    memcpy(d->curve, by_lambda, (size_t)ws->m * sizeof *d->curve);
    kmp_derivatives_solve(ws, point);
    for (int i = 0; i < ws->n; i++)
        d->force[i] = -d->x[i];
}

void kmp_derivatives_weigh(kempe_workspace *ws, const kmp_derivative_point *point, const kempe_forward_values *weight,
                           double *names)
{
    kmp_state_derivatives *d = ws->derivatives.self;
    const int n = ws->n, m = ws->m;
    double *by_qdd = d->room, *by_lambda = by_qdd + n;
    kmp_copy_or_zero(n, weight->qdd, by_qdd);
    kmp_copy_or_zero(m, weight->lambda, by_lambda);
    kmp_copy_or_zero(n, weight->q, d->dq);
    kmp_copy_or_zero(n, weight->qd, d->dqd);
    if (weight->y && d->outputs > 0) {
        memset(d->values, 0, (size_t)d->slopes->shown * sizeof *d->values);
        for (int k = 0; k < d->outputs; k++)
            d->values[d->shown[k]] += weight->y[k];
        kmp_slopes_gradient(d->slopes, &d->slopes->outputs, d->values,
                            &(kmp_direction){NULL, d->dq, d->dqd, by_qdd, by_lambda, names});
    }
    weigh_both(ws, point, by_qdd, by_lambda);
    if (kmp_load_change_back(ws->eval, d->force, d->curve)) { /* which changes with multipliers at constant loads */
        for (int r = 0; r < m; r++)
            by_lambda[r] += d->curve[r];
        weigh_both(ws, point, by_qdd, by_lambda);
    }
    kmp_tangents_add_transposed(&d->tangents, KMP_R_Q, point->tangents, d->force, d->dq);
    kmp_tangents_add_transposed(&d->tangents, KMP_CURVE_Q, point->tangents, d->a, d->dq);
    kmp_tangents_add_transposed(&d->tangents, KMP_R_QD, point->tangents, d->force, d->dqd);
    kmp_tangents_add_transposed(&d->tangents, KMP_CURVE_QD, point->tangents, d->a, d->dqd);
    if (names)
        kmp_slopes_weighted(d->slopes, NULL, NULL, d->a, d->force, names);
}

/* Turns gradients by all coordinates into gradients by the independent ones, their rates and the names, with which all
 * coordinates change. */
static void gather(kempe_workspace *ws, const kmp_derivative_point *point, const kempe_state_gradient *gradient)
{
    kmp_state_derivatives *d = ws->derivatives.self;
    const int n = ws->n, p = ws->part.p;
    double *by_q = d->force, *by_qd = d->x; /* both are no longer needed */
    memcpy(by_q, d->dq, (size_t)n * sizeof *by_q);
    memcpy(by_qd, d->dqd, (size_t)n * sizeof *by_qd);
    const kmp_state_change none = {.name = -1};
    for (int k = 0; k < p; k++) {
        d->unit[k] = 1;
        if (gradient->u) {
            kmp_derivatives_follow(ws, point, d->unit, NULL, &none, NULL);
            gradient->u[k] = kmp_dot(n, by_q, d->dq) + kmp_dot(n, by_qd, d->dqd);
        }
        if (gradient->ud) {
            kmp_derivatives_follow(ws, point, NULL, d->unit, &none, NULL);
            gradient->ud[k] = kmp_dot(n, by_qd, d->dqd);
        }
        d->unit[k] = 0;
    }
    for (int k = 0; gradient->p && k < d->names; k++) {
        kmp_derivatives_follow(ws, point, NULL, NULL, &(kmp_state_change){.name = k}, NULL);
        gradient->p[k] += kmp_dot(n, by_q, d->dq) + kmp_dot(n, by_qd, d->dqd);
    }
}

kempe_status kempe_workspace_forward_vjp(kempe_workspace *ws, double t, const double *q, const double *qd,
                                         const double *Q, const kempe_forward_values *weight,
                                         const kempe_forward_values *value, const kempe_state_gradient *gradient)
{
    KMP_WANTED(NULL, ws, "workspace");
    if (!given(ws, q, qd, gradient) || !kmp_workspace_given(ws, "weight", weight))
        return KEMPE_E_ARGUMENT;
    const bool closed = gradient->u || gradient->ud;
    KMP_TRY(kmp_derivatives_refuse_both(ws, gradient->q || gradient->qd, closed));
    KMP_TRY(kmp_derivatives_prepared(ws));
    KMP_TRY(kmp_derivatives_check_weights(ws, weight));
    kmp_derivative_point point;
    KMP_TRY(kmp_derivative_point_take(ws, t, q, qd, Q, closed, &point));
    kmp_state_derivatives *d = ws->derivatives.self;
    double *names = d->names > 0 ? gradient->p : NULL;
    if (names)
        memset(names, 0, (size_t)d->names * sizeof *names);
    kmp_derivatives_weigh(ws, &point, weight, names);
    kmp_copy_wanted(ws->n, d->dq, gradient->q);
    kmp_copy_wanted(ws->n, d->dqd, gradient->qd);
    kmp_copy_wanted(ws->n, d->x, gradient->Q);
    if (closed)
        gather(ws, &point, gradient);
    put_values(ws, &point, value);
    return KEMPE_OK;
}

/* -- second derivatives ------------------------------------------------------------------------------- */

kempe_status kempe_workspace_add_second_derivatives(kempe_workspace *ws)
{
    KMP_WANTED(NULL, ws, "workspace");
    KMP_TRY(kmp_derivatives_prepared(ws));
    kmp_state_derivatives *d = ws->derivatives.self;
    if (d->bends)
        return KEMPE_OK;
    ws->message[0] = '\0';
    kmp_context_clear(ws->system->context);
    const kempe_status status = kmp_second_derivatives_init(&d->second, ws->system, ws->eval->backend, 0, NULL);
    d->bends = status == KEMPE_OK;
    if (d->bends)
        return KEMPE_OK;
    (void)kmp_workspace_fail(ws, "%s", kempe_context_message(ws->system->context));
    return status == KEMPE_E_FAILED ? KEMPE_E_ARGUMENT : status;
}

static kempe_status respond_to(kempe_workspace *ws, const kmp_derivative_point *point,
                               const kempe_state_direction *along)
{
    if (along->p || along->u || along->ud)
        return KMP_WORKSPACE_REFUSE(ws,
                                    "second derivatives exist along directions of q, qd and Q only: leave out p, u and "
                                    "ud");
    kmp_derivatives_respond(ws, point, &(kmp_state_change){along->q, along->qd, along->Q, NULL, -1});
    return KEMPE_OK;
}

kempe_status kempe_workspace_forward_second(kempe_workspace *ws, double t, const double *q, const double *qd,
                                            const double *Q, const kempe_state_direction *first,
                                            const kempe_state_direction *second, const kempe_forward_values *change)
{
    KMP_WANTED(NULL, ws, "workspace");
    if (!given(ws, q, qd, first) || !kmp_workspace_given(ws, "second", second) ||
        !kmp_workspace_given(ws, "change", change))
        return KEMPE_E_ARGUMENT;
    KMP_TRY(kmp_derivatives_prepared(ws));
    kmp_state_derivatives *d = ws->derivatives.self;
    const bool more = change->y || change->q || change->qd;
    if (!d->bends || more)
        return KMP_WORKSPACE_REFUSE(ws, more ? "second derivatives are of qdd and lambda: leave out y, q and qd"
                                             : "second derivatives are not prepared: call "
                                               "kempe_workspace_add_second_derivatives first");
    KMP_TRY(kmp_derivatives_check_direction(ws, first));
    KMP_TRY(kmp_derivatives_check_direction(ws, second));
    kmp_derivative_point point;
    KMP_TRY(kmp_derivative_point_take(ws, t, q, qd, Q, false, &point));
    KMP_TRY(respond_to(ws, &point, first));
    memcpy(d->x_before, d->x, (size_t)ws->n * sizeof *d->x);
    memcpy(d->a_before, d->a, (size_t)ws->m * sizeof *d->a);
    KMP_TRY(respond_to(ws, &point, second));
    const kmp_instant at = kmp_instant_of(ws->eval, t, ws->q, ws->qd, ws->answer, ws->answer + ws->n);
    kmp_formulas_place(&d->second.bent, &at);
    const kmp_second_values bent =
        kmp_second_derivatives_along(&d->second, &(kmp_variation){first->q, first->qd, d->x_before, d->a_before},
                                     &(kmp_variation){second->q, second->qd, d->x, d->a}, NULL);
    memcpy(d->force, bent.force, (size_t)ws->n * sizeof *d->force);
    memcpy(d->curve, bent.curve, (size_t)ws->m * sizeof *d->curve);
    kmp_derivatives_answer(ws, &point);
    kmp_copy_wanted(ws->n, d->x, change->qdd);
    kmp_copy_wanted(ws->m, d->a, change->lambda);
    return KEMPE_OK;
}
