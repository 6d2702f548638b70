/* SPDX-License-Identifier: BSD-3-Clause */
/* Steps of constant length from a closed state, with the derivatives of the new state: the classical Runge-Kutta method
 * of order four in the independent coordinates. At each stage the loops are closed by Newton's method, and derivatives
 * are along closed motions; the method itself is differentiated, to rounding. */
#include "analyses/derivatives/state_derivatives.h"
#include "base/context.h"
#include "base/memory.h"
#include "constraints/tolerances.h"
#include "model/data/state.h"
#include <kempe/derivatives.h>
#include <math.h>
#include <string.h>

enum { STAGES = 4 };

/* The state at the beginning of a step and at a stage, and sums of slopes; derivatives by (u, ud, Q, names), columns of
 * 2 p values: of the beginning, the stage, its slope, and the sum. */
typedef struct kmp_state_step {
    kmp_arena arena;
    int p, n, columns, names;                                   /* for which it was made */
    int *hold;                                                  /* n: u */
    double *q, *qd, *qdd, *q_sum, *qd_sum, *stage_q, *stage_qd; /* n */
    double *udd_u, *udd_ud, *udd_Q, *udd_p;                     /* p x p, p x p, p x n, p x k */
    double *begin, *stage, *slope, *sum;                        /* 2 p x columns */
} kmp_state_step;

static void free_step(void *self)
{
    kmp_state_step *s = self;
    kmp_arena_free(&s->arena);
    kmp_free(s);
}

static kempe_status make_step(kempe_workspace *ws)
{
    const kmp_state_derivatives *d = ws->derivatives.self;
    const int n = ws->n, p = ws->part.p, columns = 2 * p + n + d->names;
    kmp_state_step *before = ws->step.self;
    if (before && before->names == d->names)
        return KEMPE_OK;
    if (before)
        free_step(before);
    ws->step.self = NULL;
    KMP_MAKE(ws->system->context, kmp_state_step, s);
    ws->step = (kmp_workspace_part){s, free_step};
    *s = (kmp_state_step){.p = p, .n = n, .columns = columns, .names = d->names};
    if (KMP_ARENA_MAKE(&s->arena, KMP_ROOM(int, n, &s->hold),
                       KMP_ROOM(double, n, &s->q, &s->qd, &s->qdd, &s->q_sum, &s->qd_sum, &s->stage_q, &s->stage_qd),
                       KMP_ROOM(double, p *p, &s->udd_u, &s->udd_ud), KMP_ROOM(double, p *n, &s->udd_Q),
                       KMP_ROOM(double, p * d->names, &s->udd_p),
                       KMP_ROOM(double, 2 * p * columns, &s->begin, &s->stage, &s->slope, &s->sum)))
        return KEMPE_OK;
    free_step(s);
    ws->step.self = NULL;
    return kmp_made(ws->system->context, false);
}

/* The slope of the derivatives at a stage: of u their rates, of ud by the chain rule. */
static void slope_at(kmp_state_step *s)
{
    const int p = s->p;
    for (int c = 0; c < s->columns; c++) {
        const double *z = s->stage + 2 * (ptrdiff_t)p * c;
        double *out = s->slope + 2 * (ptrdiff_t)p * c;
        const int effort = c - 2 * p, name = effort - s->n;
        memcpy(out, z + p, (size_t)p * sizeof *out);
        for (int i = 0; i < p; i++) {
            double sum = name >= 0     ? s->udd_p[i + (ptrdiff_t)name * p]
                         : effort >= 0 ? s->udd_Q[i + (ptrdiff_t)effort * p]
                                       : 0;
            for (int j = 0; j < p; j++)
                sum += s->udd_u[i + j * p] * z[j] + s->udd_ud[i + j * p] * z[p + j];
            out[p + i] = sum;
        }
    }
}

/* Accelerations at (t, q, qd), and with derivatives their slope. */
static kempe_status evaluate(kempe_workspace *ws, kmp_state_step *s, double t, const double *q, const double *qd,
                             const double *Q, bool derives)
{
    const kempe_workspace_derivatives out = {
        .udd_u = s->udd_u, .udd_ud = s->udd_ud, .udd_Q = s->udd_Q, .udd_p = s->names > 0 ? s->udd_p : NULL};
    if (!derives)
        return kempe_workspace_forward_dynamics(ws, t, q, qd, Q, s->qdd, NULL);
    KMP_TRY(kempe_workspace_forward_derivatives(ws, t, q, qd, Q, s->qdd, NULL, &out));
    slope_at(s);
    return KEMPE_OK;
}

static void add_scaled(int count, const double *x, double factor, const double *y, double *out)
{
    for (int i = 0; i < count; i++)
        out[i] = x[i] + factor * y[i];
}

/* One step from (t, q, qd), closed, and from the derivatives in s->begin. */
static kempe_status step(kempe_workspace *ws, kmp_state_step *s, double t, double h, const double *Q, bool derives)
{
    static const double place[STAGES] = {0, 0.5, 0.5, 1}, share[STAGES] = {1. / 6, 1. / 3, 1. / 3, 1. / 6};
    const int n = s->n, all = 2 * s->p * s->columns;
    memcpy(s->stage_q, s->q, (size_t)n * sizeof *s->q);
    memcpy(s->stage_qd, s->qd, (size_t)n * sizeof *s->qd);
    memcpy(s->q_sum, s->q, (size_t)n * sizeof *s->q);
    memcpy(s->qd_sum, s->qd, (size_t)n * sizeof *s->qd);
    if (derives) {
        memcpy(s->stage, s->begin, (size_t)all * sizeof *s->stage);
        memcpy(s->sum, s->begin, (size_t)all * sizeof *s->sum);
    }
    for (int k = 0; k < STAGES; k++) {
        KMP_TRY(evaluate(ws, s, t + place[k] * h, s->stage_q, s->stage_qd, Q, derives));
        add_scaled(n, s->q_sum, share[k] * h, s->stage_qd, s->q_sum);
        add_scaled(n, s->qd_sum, share[k] * h, s->qdd, s->qd_sum);
        if (derives)
            add_scaled(all, s->sum, share[k] * h, s->slope, s->sum);
        if (k + 1 == STAGES)
            break;
        /* The next stage. Dependent coordinates are predicted in the same way, and closed. */
        add_scaled(n, s->q, place[k + 1] * h, s->stage_qd, s->stage_q);
        add_scaled(n, s->qd, place[k + 1] * h, s->qdd, s->stage_qd);
        if (derives)
            add_scaled(all, s->begin, place[k + 1] * h, s->slope, s->stage);
        KMP_TRY(kempe_workspace_close(ws, t + place[k + 1] * h, s->stage_q, s->stage_qd, s->hold));
    }
    KMP_TRY(kempe_workspace_close(ws, t + h, s->q_sum, s->qd_sum, s->hold));
    memcpy(s->q, s->q_sum, (size_t)n * sizeof *s->q);
    memcpy(s->qd, s->qd_sum, (size_t)n * sizeof *s->qd);
    if (derives)
        memcpy(s->begin, s->sum, (size_t)all * sizeof *s->begin);
    return KEMPE_OK;
}

/* KEMPE_E_FAILED where the loops are so far open that closing them would give another state. */
static kempe_status check_begin(kempe_workspace *ws, double t, const double *q)
{
    int row = 0;
    kmp_eval_closure(ws->eval, t, q);
    for (int r = 1; r < ws->m; r++)
        if (kmp_eval_opening(ws->eval, r) > kmp_eval_opening(ws->eval, row))
            row = r;
    if (ws->m == 0 || kmp_eval_opening(ws->eval, row) <= KMP_STEP_OPEN)
        return KEMPE_OK;
    return kmp_workspace_fail(ws,
                              "steps need closed loops, but constraint equation '%s' is open by %.3g (relative) at t = "
                              "%.9g s: close the state first",
                              ws->system->row_names[row], kmp_eval_opening(ws->eval, row), t);
}

static void put_columns(const kmp_state_step *s, int first, int count, double *out)
{
    if (out)
        memcpy(out, s->begin + 2 * (ptrdiff_t)s->p * first, 2 * (size_t)s->p * (size_t)count * sizeof *out);
}

kempe_status kempe_workspace_step(kempe_workspace *ws, double t, double h, int steps, double *q, double *qd,
                                  const double *Q, const kempe_step_derivatives *out)
{
    KMP_WANTED(NULL, ws, "workspace");
    if (!kmp_workspace_given(ws, "q", q) || !kmp_workspace_given(ws, "qd", qd))
        return KEMPE_E_ARGUMENT;
    KMP_TRY(kmp_workspace_check_time(ws, t));
    KMP_TRY(kmp_workspace_check_finite(ws, "q of", kmp_workspace_coordinate_name, ws->n, q));
    KMP_TRY(kmp_workspace_check_finite(ws, "qd of", kmp_workspace_coordinate_name, ws->n, qd));
    KMP_TRY(kmp_workspace_check_finite(ws, "Q of", kmp_workspace_coordinate_name, ws->n, Q));
    if (!(fabs(h) > 0 && fabs(h) < INFINITY) || steps < 1)
        return KMP_WORKSPACE_REFUSE(ws,
                                    "a step of a length that is not zero is required, and at least one of them, not %d "
                                    "of %g s",
                                    steps, h);
    KMP_TRY(kmp_derivatives_prepared(ws));
    const kempe_model *model = ws->system->model;
    for (int k = 0; k < kmp_model_state_count(model); k++)
        if (kmp_model_state(model, k)->next || kmp_model_state(model, k)->delayed)
            return KMP_WORKSPACE_REFUSE(
                ws,
                "steps do not exist for models with samples, events of states or delays, as of state "
                "'%s': use a stepper",
                kmp_model_state(model, k)->name);
    if (ws->friction.self)
        return KMP_WORKSPACE_REFUSE(ws,
                                    "steps do not pass events of friction that sticks and of contacts: use a flow, or "
                                    "make the workspace with friction that slips");
    if (!ws->chosen)
        return kmp_workspace_fail(ws, "steps need independent coordinates, and none are chosen at t = %.9g s", t);
    KMP_TRY(make_step(ws));
    kmp_state_step *s = ws->step.self;
    const int n = s->n, p = s->p;
    const bool derives = out && (out->x_x || out->x_Q || out->x_p);
    const int *u = kempe_workspace_independent(ws);
    for (int k = 0; k < p; k++)
        s->hold[u[k]] = 1;
    memcpy(s->q, q, (size_t)n * sizeof *q);
    memcpy(s->qd, qd, (size_t)n * sizeof *qd);
    KMP_TRY(check_begin(ws, t, q));
    KMP_TRY(kempe_workspace_close(ws, t, s->q, s->qd, s->hold));
    memset(s->begin, 0, 2 * (size_t)p * (size_t)s->columns * sizeof *s->begin);
    for (int k = 0; k < 2 * p; k++)
        s->begin[k + 2 * (ptrdiff_t)p * k] = 1;
    const bool before = kmp_interrupt_taken(ws->system->context);
    for (int k = 0; k < steps; k++) {
        if (kmp_workspace_interrupted(ws, before, k, steps, "steps"))
            return KEMPE_STOPPED;
        KMP_TRY(step(ws, s, t + k * h, h, Q, derives));
    }
    memcpy(q, s->q, (size_t)n * sizeof *q);
    memcpy(qd, s->qd, (size_t)n * sizeof *qd);
    if (derives) {
        put_columns(s, 0, 2 * p, out->x_x);
        put_columns(s, 2 * p, n, out->x_Q);
        put_columns(s, 2 * p + n, s->names, out->x_p);
    }
    return KEMPE_OK;
}
