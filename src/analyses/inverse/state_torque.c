/* SPDX-License-Identifier: BSD-3-Clause */
/* Inverse dynamics with the loops closed at a state of the public workspace: forces of actuators for wanted
 * accelerations, by the same equations as along a motion (inverse_dynamics.h); and the equations of closed motions in
 * the independent coordinates, which operational-space control needs. */
#include "analyses/inverse/inverse_dynamics.h"
#include "base/context.h"
#include "base/memory.h"
#include "constraints/tolerances.h"
#include "constraints/workspace/state_workspace.h"
#include "linalg/dense/dot.h"
#include "model/data/body.h"
#include "model/data/coordinates.h"
#include <kempe/inverse.h>
#include <math.h>
#include <string.h>

static void free_actuators(void *self)
{
    kmp_inverse_free(self);
    kmp_free(self);
}

static kempe_status find_actuators(kempe_workspace *ws, int count, const char *const *names, const double *weights,
                                   int *actuator)
{
    for (int k = 0; k < count; k++) {
        if (!names[k])
            return KMP_WORKSPACE_REFUSE(ws, "a name of an actuator is NULL");
        if (kmp_coordinate_find(ws->system->model, "actuators", names[k], strlen(names[k]), &actuator[k]) != KEMPE_OK)
            return KMP_WORKSPACE_REFUSE(ws, "%s", kempe_context_message(ws->system->context));
        for (int before = 0; before < k; before++)
            if (actuator[before] == actuator[k])
                return KMP_WORKSPACE_REFUSE(ws, "actuator '%s' is given twice", names[k]);
        if (weights && !(weights[k] > 0 && weights[k] < INFINITY))
            return KMP_WORKSPACE_REFUSE(ws, "the weight of actuator '%s' is not a positive number", names[k]);
    }
    return KEMPE_OK;
}

kempe_status kempe_workspace_add_actuators(kempe_workspace *ws, int count, const char *const *names,
                                           const double *weights)
{
    KMP_WANTED(NULL, ws, "workspace");
    ws->message[0] = '\0';
    kmp_context_clear(ws->system->context);
    if (count < 1 || !kmp_workspace_given(ws, "names", names))
        return count < 1 ? KMP_WORKSPACE_REFUSE(ws, "there are no actuators: name coordinates on which they act")
                         : KEMPE_E_ARGUMENT;
    KMP_TRY(kmp_workspace_refuse_contacts(ws, "forces of actuators"));
    if (ws->friction.self)
        return KMP_WORKSPACE_REFUSE(
            ws, "forces of actuators are not known while friction may stick: make the workspace with friction "
                "that slips");
    int *actuator = KMP_NEW(int, count);
    kmp_inverse *made = KMP_NEW(kmp_inverse, 1);
    kempe_status status = kmp_made(ws->system->context, actuator && made);
    if (status == KEMPE_OK)
        status = find_actuators(ws, count, names, weights, actuator);
    if (status == KEMPE_OK) {
        kmp_context_clear(ws->system->context);
        status = kmp_inverse_init(made, ws->eval, count, actuator, weights);
        if (status == KEMPE_E_ARGUMENT)
            (void)kmp_workspace_fail(ws, "%s", kempe_context_message(ws->system->context));
    }
    kmp_free(actuator);
    if (status != KEMPE_OK) {
        kmp_free(made);
        return status;
    }
    if (ws->actuators.self)
        ws->actuators.free(ws->actuators.self);
    ws->actuators = (kmp_workspace_part){made, free_actuators};
    return KEMPE_OK;
}

int kempe_workspace_actuator_count(const kempe_workspace *ws)
{
    const kmp_inverse *v = ws ? ws->actuators.self : NULL;
    return v ? v->a : 0;
}

/* The unbalanced coordinate, where the actuators cannot produce the accelerations. */
static kempe_status judge(kempe_workspace *ws, const kmp_inverse *v, double t)
{
    const kempe_model *model = ws->system->model;
    int most = 0;
    if (!(v->unmet > KMP_EFFORTS_LEFT * v->size))
        return KEMPE_OK;
    for (int k = 1; k < v->p; k++)
        if (fabs(v->left[k]) * ws->system->scale[v->part.u[k]] >
            fabs(v->left[most]) * ws->system->scale[v->part.u[most]])
            most = k;
    const int u = v->part.u[most];
    return kmp_workspace_fail(
        ws,
        "the actuators cannot produce these accelerations: %.6g %s on '%s' are not balanced at t = "
        "%.9g s; they act on %d of %d degrees of freedom",
        v->left[most], kmp_model_motion(model, u)->rotation ? "N m" : "N", kmp_model_motion(model, u)->name, t, v->rank,
        v->freedoms);
}

kempe_status kempe_workspace_actuator_forces(kempe_workspace *ws, double t, const double *q, const double *qd,
                                             const double *qdd, double *tau, double *lambda)
{
    KMP_WANTED(NULL, ws, "workspace");
    if (!kmp_workspace_given(ws, "q", q) || !kmp_workspace_given(ws, "qd", qd) ||
        !kmp_workspace_given(ws, "qdd", qdd) || !kmp_workspace_given(ws, "tau", tau))
        return KEMPE_E_ARGUMENT;
    kmp_inverse *v = ws->actuators.self;
    if (!v)
        return KMP_WORKSPACE_REFUSE(ws, "there are no actuators: call %s first", "kempe_workspace_add_actuators");
    KMP_TRY(kmp_workspace_check_time(ws, t));
    KMP_TRY(kempe_workspace_evaluate(ws, t, q, qd));
    KMP_TRY(kmp_workspace_require_closed(ws, "forces of actuators", t));
    kmp_context_clear(ws->system->context);
    ws->stale = true;
    if (kmp_inverse_at(v, t, ws->q, ws->qd, qdd) != KEMPE_OK) {
        KMP_TRY(kmp_workspace_check_finite(ws, "the acceleration of", kmp_workspace_coordinate_name, ws->n, qdd));
        return kmp_workspace_fail(ws, "%s", kempe_context_message(ws->system->context));
    }
    memcpy(tau, v->tau, (size_t)v->a * sizeof *tau);
    if (lambda)
        memcpy(lambda, v->lambda, (size_t)ws->m * sizeof *lambda);
    return judge(ws, v, t);
}

kempe_status kempe_workspace_closed_equations(kempe_workspace *ws, double t, const double *q, const double *qd,
                                              const kempe_closed_equations *out)
{
    KMP_WANTED(NULL, ws, "workspace");
    if (!kmp_workspace_given(ws, "q", q) || !kmp_workspace_given(ws, "qd", qd) || !kmp_workspace_given(ws, "out", out))
        return KEMPE_E_ARGUMENT;
    KMP_TRY(kmp_workspace_refuse_contacts(ws, "equations of closed motions"));
    if (ws->friction.self)
        return KMP_WORKSPACE_REFUSE(
            ws, "equations of closed motions do not exist while friction may stick: make the workspace with "
                "friction that slips");
    const kempe_system *system = ws->system;
    if (system->load_row_count > 0)
        return KMP_WORKSPACE_REFUSE(
            ws,
            "equations of closed motions do not exist for this model, because a force depends on the multiplier "
            "of constraint equation '%s'",
            system->row_names[system->load_rows[0]]);
    const int n = ws->n, p = ws->part.p;
    bool reduced;
    KMP_TRY(kempe_workspace_evaluate(ws, t, q, qd));
    KMP_TRY(kmp_workspace_require_closed(ws, "equations of closed motions", t));
    KMP_TRY(kmp_workspace_solve(ws, t, ws->q, ws->qd, NULL, &reduced));
    if (!reduced)
        return kmp_workspace_fail(ws, "the independent coordinates do not describe the motion at t = %.9g s", t);
    const double *x = ws->red.x;
    if (out->X)
        memcpy(out->X, x, (size_t)n * (size_t)p * sizeof *x);
    if (out->drift)
        memcpy(out->drift, ws->red.a0, (size_t)n * sizeof *x);
    for (int k = 0; out->mass && k < p; k++) {
        double *product = ws->row; /* M X, by columns */
        for (int i = 0; i < n; i++)
            product[i] = kmp_dot(n, ws->mass + (ptrdiff_t)i * n, x + (ptrdiff_t)k * n);
        for (int i = 0; i < p; i++)
            out->mass[i + (ptrdiff_t)k * p] = kmp_dot(n, x + (ptrdiff_t)i * n, product);
    }
    for (int k = 0; out->bias && k < p; k++) { /* X' (C + M a0) */
        double sum = 0;
        for (int i = 0; i < n; i++)
            sum += x[i + (ptrdiff_t)k * n] * (ws->bias[i] + kmp_dot(n, ws->mass + (ptrdiff_t)i * n, ws->red.a0));
        out->bias[k] = sum;
    }
    return KEMPE_OK;
}
