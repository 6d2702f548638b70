/* SPDX-License-Identifier: BSD-3-Clause */
/* The public workspace. Evaluation and accelerations are the same as in runs: by articulated bodies if that costs less,
 * or on the independent rows and coordinates of the start while these are good. Otherwise the saddle system on rows of
 * the present state is solved. Closing is by least changes. */
#include "constraints/workspace/state_workspace.h"
#include "base/memory.h"
#include "constraints/closing/assemble.h"
#include "constraints/closing/assembly.h"
#include "constraints/evaluation/evaluator.h"
#include "constraints/evaluation/load_multipliers.h"
#include "constraints/evaluation/state_ends.h"
#include "constraints/evaluation/validity.h"
#include "constraints/tolerances.h"
#include "dynamics/load_dependent.h"
#include "linalg/dense/dot.h"
#include "model/data/body.h"
#include "model/data/closure.h"
#include "model/data/closure_table.h"
#include "model/data/force.h"
#include <kempe/check.h>
#include <math.h>
#include <stdarg.h>
#include <stdio.h>
#include <string.h>

enum { MAX_CORRECTIONS = 100 };

kempe_status kmp_workspace_fail(kempe_workspace *ws, const char *sentence, ...)
{
    va_list arguments;
    va_start(arguments, sentence);
    (void)vsnprintf(ws->message, sizeof ws->message, sentence, arguments);
    va_end(arguments);
    return KEMPE_E_FAILED;
}

kempe_status kmp_workspace_refuse_contacts(kempe_workspace *ws, const char *what)
{
    kempe_context *context = ws->system->context;
    const kempe_status status = kmp_refuse_contacts(ws->system->model, what);
    if (status == KEMPE_OK)
        return KEMPE_OK;
    kmp_context_clear(context); /* of messages before this one */
    (void)kmp_refuse_contacts(ws->system->model, what);
    (void)kmp_workspace_fail(ws, "%s", kempe_context_message(context));
    return status;
}

kempe_status kmp_workspace_require_decisions(kempe_workspace *ws, const char *what)
{
    const kempe_model *model = ws->system->model;
    for (int k = 0; !ws->friction.self && k < kmp_model_force_count(model); k++)
        if (kmp_model_force(model, k)->kind == KMP_FORCE_TOUCH)
            return KMP_WORKSPACE_REFUSE(
                ws,
                "%s: contact '%s' opens and closes, which is unknown at a state: make the workspace with "
                "friction that sticks (stick), which evaluates contacts, too",
                what, kmp_model_force(model, k)->name);
    return KEMPE_OK;
}

bool kmp_workspace_given(kempe_workspace *ws, const char *name, const void *argument)
{
    if (!argument)
        (void)kmp_workspace_fail(ws, KMP_MISSING, name);
    return argument;
}

kempe_status kmp_workspace_check_time(kempe_workspace *ws, double t)
{
    if (isfinite(t))
        return KEMPE_OK;
    return KMP_WORKSPACE_REFUSE(ws, "the time t is %g: give a finite number of seconds", t);
}

const char *kmp_workspace_coordinate_name(const kempe_workspace *ws, int entry)
{
    return kmp_model_motion(ws->system->model, entry)->name;
}

const char *kmp_workspace_independent_name(const kempe_workspace *ws, int entry)
{
    return kmp_workspace_coordinate_name(ws, ws->part.u[entry]);
}

const char *kmp_workspace_row_name(const kempe_workspace *ws, int entry)
{
    return ws->system->row_names[entry];
}

kempe_status kmp_workspace_check_finite(kempe_workspace *ws, const char *what, kmp_entry_name *name, int count,
                                        const double *x)
{
    int entry = 0;
    while (x && entry < count && isfinite(x[entry]))
        entry++;
    if (!x || entry >= count)
        return KEMPE_OK;
    return KMP_WORKSPACE_REFUSE(ws, "%s '%s' is %g: give a finite number", what, name(ws, entry), x[entry]);
}

/* -- new and free ------------------------------------------------------------------------------------ */

static kempe_status choose_bodies(kempe_workspace *ws, const kempe_assembly *a);

kempe_status kmp_workspace_new(const kempe_system *system, kempe_workspace **workspace)
{
    KMP_MAKE(system->context, kempe_workspace, ws);
    ws->system = system;
    ws->n = system->n;
    ws->m = system->m;
    ws->eval = kmp_eval_new(system, kmp_backend_default());
    const size_t n = (size_t)ws->n, m = (size_t)ws->m;
    kempe_assembly *a = NULL;
    kempe_status status = kmp_assembly_at_start(system, &a);
    bool made = ws->eval && status != KEMPE_E_MEMORY &&
                KMP_ARENA_MAKE(&ws->arena, KMP_ROOM(bool, n, &ws->hold), KMP_ROOM(double, n *n, &ws->mass),
                               KMP_ROOM(double, m *n, &ws->jacobian), KMP_ROOM(double, m, &ws->h, &ws->jdqd),
                               KMP_ROOM(double, n + m, &ws->answer, &ws->row), KMP_ROOM(int, m, &ws->closure_rows),
                               KMP_ROOM(bool, m, &ws->of_modes), KMP_ROOM(double, m, &ws->share),
                               KMP_ROOM(double, system->events.count, &ws->friction.mode, &ws->change),
                               KMP_ROOM(double, n, &ws->bias, &ws->q, &ws->qd, &ws->trial));
    /* The rows and coordinates of the start; none if it cannot be assembled. */
    if (made && status == KEMPE_OK && !a->inner_q) {
        kmp_eval_closure(ws->eval, 0, a->q);
        kempe_status chosen = kmp_partition_init(&ws->part, system, ws->eval->jacobian, NULL, 0);
        ws->chosen = chosen == KEMPE_OK && kmp_reduction_init(&ws->red, ws->eval, &ws->part) == KEMPE_OK;
        made = chosen != KEMPE_E_MEMORY;
    }
    made = made && kmp_saddle_init_anywhere(&ws->saddle, ws->eval, ws->chosen ? ws->part.r : -1) &&
           kmp_least_change_init(&ws->least, ws->eval) && choose_bodies(ws, a) == KEMPE_OK;
    kempe_assembly_free(a);
    kmp_context_clear(system->context);
    if (made) {
        const kempe_system *s = ws->system;
        for (int r = 0; r < s->m; r++) {
            ws->of_modes[r] = kmp_closure_is_of_modes(kmp_model_closure(s->model, s->rows[r].closure));
            if (!ws->of_modes[r])
                ws->closure_rows[ws->closure_count++] = r;
        }
        *workspace = ws;
        return KEMPE_OK;
    }
    kempe_workspace_free(ws);
    return kmp_fail_memory(system->context);
}

kempe_status kmp_workspace_take_friction(kempe_workspace *ws, kmp_workspace_friction friction)
{
    kmp_saddle_free(&ws->saddle);
    if (!kmp_saddle_init_anywhere(&ws->saddle, ws->eval, -1))
        return kmp_fail_memory(ws->system->context);
    ws->by_bodies = false;
    friction.mode = ws->friction.mode;
    ws->friction = friction;
    return KEMPE_OK;
}

KMP_GETTER(int kempe_workspace_independent_count(const kempe_workspace *workspace), workspace,
           workspace->chosen ? workspace->part.p : 0, 0)
KMP_GETTER(const int *kempe_workspace_independent(const kempe_workspace *workspace), workspace,
           workspace->chosen ? workspace->part.u : NULL, NULL)

kmp_present_inputs *kmp_workspace_inputs(kempe_workspace *ws)
{
    return &ws->eval->inputs;
}

kempe_status kempe_workspace_set_input(kempe_workspace *ws, int input, double t, double value, double rate,
                                       double acceleration)
{
    const double values[3] = {value, rate, acceleration};
    int first;
    KMP_WANTED(NULL, ws, "workspace");
    if (input < 0 || input >= ws->eval->inputs.count || !isfinite(t + value + rate + acceleration))
        return KMP_WORKSPACE_REFUSE(ws, "there is no input %d, or its value is not finite", input);
    kmp_present_inputs_give(&ws->eval->inputs, input, t, values);
    (void)kmp_present_inputs_enter(&ws->eval->inputs, t, &first);
    ws->stale = true;
    return KEMPE_OK;
}

void kempe_workspace_free(kempe_workspace *ws)
{
    if (!ws)
        return;
    if (ws->friction.self)
        ws->friction.free(ws->friction.self);
    kmp_stage_lanes_free(&ws->many.stages);
    const kmp_workspace_part part[] = {ws->derivatives, ws->step, ws->actuators, ws->determinant};
    for (size_t k = 0; k < sizeof part / sizeof *part; k++)
        if (part[k].self)
            part[k].free(part[k].self);
    kmp_arena_free(&ws->arena);
    kmp_reduction_free(&ws->red);
    kmp_partition_free(&ws->part);
    kmp_saddle_free(&ws->saddle);
    kmp_saddle_free(&ws->bodies);
    kmp_least_change_free(&ws->least);
    kmp_eval_free(ws->eval);
    kmp_free(ws);
}

/* -- values ------------------------------------------------------------------------------------------ */

/* Keeps the state of a call: `qd` may be NULL, and q and qd may be outputs of the caller. */
static void workspace_keep_state(kempe_workspace *ws, double t, const double *q, const double *qd)
{
    ws->t = t;
    memmove(ws->q, q, (size_t)ws->n * sizeof *q);
    if (qd)
        memmove(ws->qd, qd, (size_t)ws->n * sizeof *qd);
    else /* NOLINTNEXTLINE(clang-analyzer-core.NonNullParamChecker): qd may be NULL, but for the workspace's own */
        memset(ws->qd, 0, (size_t)ws->n * sizeof *ws->qd);
}

/* Copies the evaluator's values. */
static void workspace_copy(kempe_workspace *ws)
{
    const kmp_evaluator *eval = ws->eval;
    kmp_eval_dense_mass(eval, ws->mass);
    kmp_eval_dense_jacobian(eval, ws->jacobian);
    memcpy(ws->bias, eval->bias, (size_t)ws->n * sizeof *ws->bias);
    memcpy(ws->h, eval->h, (size_t)ws->m * sizeof *ws->h);
    memcpy(ws->jdqd, eval->jdqd, (size_t)ws->m * sizeof *ws->jdqd);
}

/* The message of a condition that ends runs, or of one whose validity ends at the state, unless one is there. */
static void note_doubt(kempe_workspace *ws)
{
    int from = 0;
    const int broken = ws->message[0] == '\0'
                           ? kmp_eval_next_end(ws->eval, KMP_ENDS_OF_MODEL, ws->t, ws->q, ws->qd, NULL, NULL, &from)
                           : -1;
    if (broken >= 0) {
        kmp_text text = {0};
        kmp_put_end(&text, ws->system, broken, ws->t);
        (void)kmp_workspace_fail(ws, KMP_RUN_WOULD_END, text.s ? text.s : "");
        kmp_text_free(&text);
    }
    from = 0;
    const int invalid = ws->message[0] == '\0' && kmp_eval_validity(ws->eval, ws->t, ws->q, ws->qd, NULL, NULL)
                            ? kmp_eval_next_invalid(ws->eval, &from)
                            : -1;
    if (invalid >= 0) {
        kmp_text text = {0};
        kmp_eval_put_invalid(ws->eval, invalid, ws->t, &text);
        (void)kmp_workspace_fail(ws, "%s", text.s ? text.s : "");
        kmp_text_free(&text);
    }
}

/* Modes of friction and contacts with the generalized forces Q. */
static kempe_status decide(kempe_workspace *ws, const double *Q)
{
    kmp_workspace_friction *friction = &ws->friction;
    const size_t count = (size_t)ws->system->events.count;
    if (friction->kept) {
        kmp_eval_set_modes(ws->eval, friction->mode);
        ws->eval->conditions.holds_friction = true;
        return KEMPE_OK;
    }
    ws->eval->outer.given = Q;
    kempe_status status = friction->decide(friction->self, ws->t, ws->q, ws->qd);
    ws->eval->outer.given = NULL;
    friction->decided = status == KEMPE_OK;
    if (status != KEMPE_OK)
        return kmp_workspace_fail(ws, "%s", kempe_context_message(ws->system->context));
    memcpy(friction->mode, ws->eval->conditions.mode, count * sizeof *friction->mode);
    return KEMPE_OK;
}

kempe_status kempe_workspace_keep_modes(kempe_workspace *ws, const kempe_workspace *of)
{
    KMP_WANTED(NULL, ws, "workspace");
    kmp_workspace_friction *friction = &ws->friction;
    ws->message[0] = '\0';
    friction->kept = false;
    if (!of || !friction->self)
        return KEMPE_OK;
    const bool same = of->system == ws->system && of->friction.self;
    if (!same || !of->friction.decided)
        return KMP_WORKSPACE_REFUSE(ws,
                                    same ? "there are no modes of friction and contacts to keep: evaluate a state first"
                                         : "the other workspace has no modes of friction and contacts of this system");
    if (of != ws)
        memcpy(friction->mode, of->friction.mode, (size_t)ws->system->events.count * sizeof *friction->mode);
    friction->kept = true;
    return KEMPE_OK;
}

static kempe_status evaluate(kempe_workspace *ws, double t, const double *q, const double *qd, const double *Q)
{
    kmp_evaluator *eval = ws->eval;
    const kempe_system *s = ws->system;
    ws->message[0] = ws->visits ? ws->message[0] : '\0';
    workspace_keep_state(ws, t, q, qd);
    ws->stale = false;
    if (ws->friction.self)
        KMP_TRY(decide(ws, Q));
    kmp_eval_closure(eval, t, ws->q);
    kmp_eval_mass(eval);
    kmp_load_forget(eval);
    kmp_eval_bias(eval, ws->qd);
    note_doubt(ws);
    workspace_copy(ws);
    if (kmp_all_finite(s->mass.count, eval->mass) && kmp_all_finite(ws->n, eval->bias) &&
        kmp_all_finite(ws->m, eval->h) && kmp_all_finite(s->jacobian.count, eval->jacobian) &&
        kmp_all_finite(ws->m, eval->jdqd))
        return KEMPE_OK;
    return kmp_workspace_fail(ws, "the equations are not finite at t = %.9g s", t);
}

kempe_status kempe_workspace_evaluate(kempe_workspace *ws, double t, const double *q, const double *qd)
{
    KMP_WANTED(NULL, ws, "workspace");
    KMP_TRY(kmp_workspace_check_time(ws, t));
    return kmp_workspace_given(ws, "q", q) ? evaluate(ws, t, q, qd, NULL) : KEMPE_E_ARGUMENT;
}

/* Evaluates M, C, h, J and jdqd if accelerations did not need them. */
static const kempe_workspace *up_to_date(const kempe_workspace *workspace)
{
    kempe_workspace *ws = (kempe_workspace *)workspace;
    if (ws->stale)
        (void)evaluate(ws, ws->t, ws->q, ws->qd, NULL);
    return ws;
}

KMP_GETTER(const char *kempe_workspace_message(const kempe_workspace *workspace), workspace, workspace->message, "")

KMP_GETTER(int kempe_workspace_closure_row_count(const kempe_workspace *workspace), workspace, workspace->closure_count,
           0)
KMP_GETTER(const int *kempe_workspace_closure_rows(const kempe_workspace *workspace), workspace,
           workspace->closure_rows, NULL)

#define VALUES(name)                                                                                                   \
    KMP_GETTER(const double *kempe_workspace_##name(const kempe_workspace *workspace), workspace,                      \
               up_to_date(workspace)->name, NULL)
VALUES(mass)
VALUES(bias)
VALUES(h)
VALUES(jacobian)
VALUES(jdqd)

KMP_GETTER(double kempe_workspace_kinetic(const kempe_workspace *workspace), workspace,
           up_to_date(workspace)->eval->mass ? kmp_eval_kinetic(workspace->eval, workspace->qd) : 0, NAN)
KMP_GETTER(double kempe_workspace_potential(const kempe_workspace *workspace), workspace,
           up_to_date(workspace)->eval->mass ? kmp_eval_potential(workspace->eval, workspace->t, workspace->q) : 0, NAN)

/* -- dynamics ---------------------------------------------------------------------------------------- */

kempe_status kempe_workspace_inverse_dynamics(kempe_workspace *ws, double t, const double *q, const double *qd,
                                              const double *qdd, double *Q)
{
    KMP_WANTED(NULL, ws, "workspace");
    if (!kmp_workspace_given(ws, "q", q) || !kmp_workspace_given(ws, "qd", qd) ||
        !kmp_workspace_given(ws, "qdd", qdd) || !kmp_workspace_given(ws, "Q", Q))
        return KEMPE_E_ARGUMENT;
    KMP_TRY(kmp_workspace_check_time(ws, t));
    KMP_TRY(kmp_workspace_check_finite(ws, "the acceleration of", kmp_workspace_coordinate_name, ws->n, qdd));
    if (ws->system->load_row_count > 0) {
        (void)kmp_workspace_fail(ws,
                                 "inverse dynamics of the open tree: a force depends on the multiplier of constraint "
                                 "equation '%s', which is not known there: name actuators, whose forces have it",
                                 ws->system->row_names[ws->system->load_rows[0]]);
        return KEMPE_E_ARGUMENT;
    }
    KMP_TRY(evaluate(ws, t, q, qd, NULL));
    memcpy(ws->answer, ws->eval->bias, (size_t)ws->n * sizeof *Q);
    kmp_eval_add_mass_times(ws->eval, qdd, ws->answer);
    memcpy(Q, ws->answer, (size_t)ws->n * sizeof *Q);
    return KEMPE_OK;
}

/* Puts a row of J into ws->row. false: it is zero, as of friction that slips and of an open contact. */
static bool take_row(kempe_workspace *ws, int row)
{
    const kmp_pattern *jac = &ws->system->jacobian;
    bool any = false;
    memset(ws->row, 0, (size_t)ws->n * sizeof *ws->row);
    for (int e = 0; e < jac->count; e++)
        if (jac->row[e] == row) {
            ws->row[jac->col[e]] = ws->eval->jacobian[e];
            any = any || ws->eval->jacobian[e] != 0;
        }
    return any;
}

/* True if a force depends on the multiplier of a row at this state: the level of friction does only while it slips. */
static bool is_load(const kempe_workspace *ws, int row)
{
    const kmp_pattern *load = &ws->system->load_jacobian;
    for (int e = 0; e < load->count; e++)
        if (load->col[e] == row && ws->eval->load_jacobian[e] != 0)
            return true;
    return false;
}

/* Finds a row whose multiplier a force depends on and which determines dropped rows, or is dropped itself; -1: none. */
static int find_shared(kempe_workspace *ws)
{
    const kempe_system *s = ws->system;
    for (int r = 0; s->load_row_count > 0 && r < ws->m; r++) {
        if (kmp_saddle_has_row(&ws->saddle, r) || !take_row(ws, r))
            continue;
        /* Shares of the kept rows in dropped row r, as multipliers: M x - J' a = -J_r', J x = 0. */
        const double *share = ws->share;
        kmp_saddle_solve(&ws->saddle, ws->row, NULL, NULL, ws->share);
        for (int k = 0; k < s->load_row_count; k++) {
            int row = s->load_rows[k];
            const bool shares = row == r || fabs(share[row]) * s->row_scale[row] > KMP_RANK_SHARED * s->row_scale[r];
            if (shares && is_load(ws, row))
                return row;
        }
    }
    return -1;
}

bool kmp_workspace_follows_loops(kempe_workspace *ws)
{
    int v, u;
    if (!ws->chosen || kmp_reduction_factor(&ws->red))
        return false;
    kmp_reduction_tangent(&ws->red);
    if (!(kmp_reduction_lever(&ws->red) <= KMP_GROWTH_LEVER) ||
        !(kmp_reduction_growth(&ws->red, &v, &u) <= KMP_EXCHANGE_WISH))
        return false;
    /* Each dropped row is compatible with the motions that the others allow, up to the gap of open loops. */
    double most = fmax(KMP_RANK_NOT_REDUNDANT, KMP_CLOSED_DECIDED * kmp_eval_residual(ws->eval));
    for (int k = 0; ws->part.r < ws->m && k < ws->part.p; k++)
        if (!(kmp_reduction_slip(&ws->red, k, ws->of_modes) * ws->system->scale[ws->part.u[k]] <= most))
            return false;
    return true;
}

/* Computes accelerations and multipliers on the choice of the start into `answer`. false: the choice is bad here. */
static bool by_partition(kempe_workspace *ws)
{
    double *udd = ws->row;
    if (ws->friction.self || ws->system->load_row_count > 0 || !kmp_workspace_follows_loops(ws) ||
        kmp_reduction_accelerate(&ws->red, udd))
        return false;
    kmp_reduction_accelerations(&ws->red, udd, ws->answer);
    kmp_reduction_multipliers(&ws->red, ws->answer, ws->answer + ws->n);
    return kmp_all_finite(ws->n + ws->m, ws->answer);
}

static kempe_status by_saddle(kempe_workspace *ws)
{
    double *a = ws->answer, t = ws->t;
    if (kmp_saddle_factor(&ws->saddle))
        return kmp_workspace_fail(ws, "the accelerations are not determined at t = %.9g s: some motion moves no mass",
                                  t);
    kmp_saddle_accelerations(&ws->saddle, a, a + ws->n);
    int shared = find_shared(ws);
    if (shared >= 0)
        return kmp_workspace_fail(
            ws,
            "a force depends on the multiplier of constraint equation '%s', which is not unique because of "
            "redundant constraints",
            ws->system->row_names[shared]);
    if (kmp_is_unsettled(ws->eval)) {
        kmp_text text = {0};
        kmp_put_unsettled(ws->eval, &text);
        (void)kmp_workspace_fail(ws, "%s", text.s ? text.s : "");
        kmp_text_free(&text);
        return KEMPE_E_FAILED;
    }
    return kmp_all_finite(ws->n + ws->m, a)
               ? KEMPE_OK
               : kmp_workspace_fail(ws, "the accelerations are not finite at t = %.9g s", t);
}

/* Computes accelerations by articulated bodies into `answer`. false: they are too inaccurate here. */
static bool by_bodies(kempe_workspace *ws, double t, const double *q, const double *qd, const double *Q)
{
    kmp_evaluator *eval = ws->eval;
    ws->message[0] = ws->visits ? ws->message[0] : '\0';
    workspace_keep_state(ws, t, q, qd);
    ws->stale = true;
    kmp_eval_set_by_bodies(eval, true);
    kmp_eval_closure(eval, t, ws->q);
    kmp_eval_mass(eval);
    kmp_eval_set_effort(eval, Q);
    kmp_eval_bias(eval, ws->qd);
    note_doubt(ws);
    bool good = kmp_saddle_factor(&ws->bodies) == 0 && kmp_saddle_keeps_digits(&ws->bodies);
    if (good)
        kmp_saddle_accelerations(&ws->bodies, ws->answer, ws->answer + ws->n);
    kmp_eval_set_effort(eval, NULL);
    kmp_eval_set_by_bodies(eval, false);
    return good && kmp_all_finite(ws->n + ws->m, ws->answer);
}

/* Chooses articulated bodies if runs may use them, all rows are independent, and they agree with M and C at the start,
 * or solve the same system to rounding there. */
static kempe_status choose_bodies(kempe_workspace *ws, const kempe_assembly *a)
{
    const kempe_system *s = ws->system;
    double size = 1, off = 0, error = INFINITY;
    if (!ws->chosen || ws->part.r < ws->m)
        return KEMPE_OK;
    kempe_status status = kmp_eval_add_articulated(ws->eval);
    if (status == KEMPE_OK && !s->bodies->program)
        return KEMPE_OK;
    kmp_eval_set_by_bodies(ws->eval, true);
    bool made = status == KEMPE_OK && kmp_saddle_init(&ws->bodies, ws->eval, &ws->part);
    kmp_eval_set_by_bodies(ws->eval, false);
    if (!made)
        return KEMPE_E_MEMORY;
    bool good = kempe_workspace_forward_dynamics(ws, 0, a->q, a->qd, NULL, ws->trial, NULL) == KEMPE_OK &&
                by_bodies(ws, 0, a->q, a->qd, NULL);
    for (int i = 0; good && i < ws->n; i++) {
        size = fmax(size, fabs(ws->trial[i]) / s->scale[i]);
        off = fmax(off, fabs(ws->answer[i] - ws->trial[i]) / s->scale[i]);
    }
    if (good && !kmp_saddle_bodies_agree(off / size, error) && !ws->eval->weighs_only) {
        KMP_TRY(evaluate(ws, 0, a->q, a->qd, NULL));
        error = kmp_saddle_backward_error(&ws->bodies, ws->answer, ws->answer + ws->n);
    }
    ws->by_bodies = good && kmp_saddle_bodies_agree(off / size, error);
    return KEMPE_OK;
}

void kmp_workspace_put_answer(const kempe_workspace *ws, double *qdd, double *lambda)
{
    memcpy(qdd, ws->answer, (size_t)ws->n * sizeof *qdd);
    if (lambda)
        memcpy(lambda, ws->answer + ws->n, (size_t)ws->m * sizeof *lambda);
}

/* The same with the force of friction that slips, as in rows of runs. */
static void put_forces(kempe_workspace *ws, double *qdd, double *lambda)
{
    kmp_workspace_put_answer(ws, qdd, lambda);
    if (lambda && ws->closure_count < ws->m)
        kmp_eval_show_friction(ws->eval, ws->t, ws->q, ws->qd, ws->answer, lambda, ws->change);
}

kempe_status kmp_workspace_accelerate(kempe_workspace *ws, const double *Q, bool *reduced)
{
    kmp_eval_set_effort(ws->eval, Q);
    *reduced = by_partition(ws);
    kempe_status status = *reduced ? KEMPE_OK : by_saddle(ws);
    kmp_eval_set_effort(ws->eval, NULL);
    if (status == KEMPE_OK)
        memcpy(ws->bias, ws->eval->bias, (size_t)ws->n * sizeof *ws->bias);
    return status;
}

kempe_status kmp_workspace_solve(kempe_workspace *ws, double t, const double *q, const double *qd, const double *Q,
                                 bool *reduced)
{
    KMP_TRY(evaluate(ws, t, q, qd, Q));
    return kmp_workspace_accelerate(ws, Q, reduced);
}

kempe_status kempe_workspace_forward_dynamics(kempe_workspace *ws, double t, const double *q, const double *qd,
                                              const double *Q, double *qdd, double *lambda)
{
    KMP_WANTED(NULL, ws, "workspace");
    if (!kmp_workspace_given(ws, "q", q) || !kmp_workspace_given(ws, "qd", qd) || !kmp_workspace_given(ws, "qdd", qdd))
        return KEMPE_E_ARGUMENT;
    KMP_TRY(kmp_workspace_check_time(ws, t));
    KMP_TRY(kmp_workspace_require_decisions(ws, "forward dynamics"));
    if (ws->by_bodies && by_bodies(ws, t, q, qd, Q)) {
        put_forces(ws, qdd, lambda);
        return KEMPE_OK;
    }
    bool reduced;
    KMP_TRY(kmp_workspace_solve(ws, t, q, qd, Q, &reduced));
    put_forces(ws, qdd, lambda);
    return KEMPE_OK;
}

/* -- closing ----------------------------------------------------------------------------------------- */

/* The most violated row of x. */
static int widest(const kempe_workspace *ws, const double *x)
{
    const double *scale = ws->system->row_scale;
    int row = 0;
    for (int r = 1; r < ws->m; r++)
        if (!(fabs(x[r]) / scale[r] <= fabs(x[row]) / scale[row]))
            row = r;
    return row;
}

kempe_status kmp_workspace_require_closed_position(kempe_workspace *ws, const char *what, double t)
{
    if (ws->m == 0 || kmp_eval_residual(ws->eval) <= KMP_CLOSED_NEAR)
        return KEMPE_OK;
    const int row = widest(ws, ws->eval->h);
    return kmp_workspace_fail(ws,
                              "%s need closed loops, but constraint equation '%s' is open by %.3g (relative) at t "
                              "= %.9g s: close the state first",
                              what, ws->system->row_names[row], kmp_eval_opening(ws->eval, row), t);
}

kempe_status kmp_workspace_require_closed(kempe_workspace *ws, const char *what, double t)
{
    KMP_TRY(kmp_workspace_require_closed_position(ws, what, t));
    if (ws->m == 0)
        return KEMPE_OK;
    kmp_eval_rates(ws->eval, ws->qd, ws->row);
    const int row = widest(ws, ws->row);
    const double open = fabs(ws->row[row]) / ws->system->row_scale[row];
    if (open <= KMP_CLOSED_NEAR * fmax(1, kmp_eval_size(ws->eval, ws->qd)))
        return KEMPE_OK;
    return kmp_workspace_fail(ws,
                              "%s need velocities that keep the loops closed, but constraint equation '%s' has the "
                              "rate %.3g (relative) at t = %.9g s: close q and qd first",
                              what, ws->system->row_names[row], open, t);
}

static kempe_status close_rates(kempe_workspace *ws, const kmp_closer *closer, double *qd)
{
    double *rate = ws->row;
    memcpy(ws->qd, qd, (size_t)ws->n * sizeof *qd);
    kmp_close_rates(closer, rate, ws->qd);
    const double size = fmax(1, kmp_eval_size(ws->eval, ws->qd));
    kmp_eval_rates(ws->eval, ws->qd, rate);
    int row = widest(ws, rate);
    double left = fabs(rate[row]) / ws->system->row_scale[row];
    if (!(left <= KMP_CLOSED_RATES * size))
        return kmp_workspace_fail(
            ws,
            "the velocities cannot be made consistent: the rate of constraint equation '%s' stays at %.3g (relative)",
            ws->system->row_names[row], left);
    memcpy(qd, ws->qd, (size_t)ws->n * sizeof *qd);
    return KEMPE_OK;
}

kempe_status kempe_workspace_close(kempe_workspace *ws, double t, double *q, double *qd, const int *hold)
{
    KMP_WANTED(NULL, ws, "workspace");
    if (!kmp_workspace_given(ws, "q", q))
        return KEMPE_E_ARGUMENT;
    const kmp_closer closer = kmp_least_change_closer(&ws->least);
    const kmp_close_rule rule = kmp_least_change_rule(MAX_CORRECTIONS);
    ws->message[0] = '\0';
    if (ws->m == 0)
        return KEMPE_OK;
    if (ws->friction.self)
        ws->friction.release(ws->eval);
    for (int k = 0; hold && k < ws->n; k++)
        ws->hold[k] = hold[k];
    ws->least.hold = hold ? ws->hold : NULL;
    memcpy(ws->trial, q, (size_t)ws->n * sizeof *q);
    if (!kmp_close(&closer, &rule, t, ws->trial).closed) {
        int row = widest(ws, ws->eval->h);
        return kmp_workspace_fail(
            ws, "the loops cannot be closed from this state: constraint equation '%s' stays open by %.3g (relative)",
            ws->system->row_names[row], kmp_eval_opening(ws->eval, row));
    }
    kempe_status status = qd ? close_rates(ws, &closer, qd) : KEMPE_OK;
    if (status == KEMPE_OK)
        memcpy(q, ws->trial, (size_t)ws->n * sizeof *q);
    return status;
}

/* The equations, and accelerations by them, at many states. The motion program runs at a group of states in the lanes
 * of vector registers, with the bits that it has at each of them separately. States that remain, and all states of
 * models with conditions, forces that depend on multipliers or a user-defined force, are evaluated one at a time. */

/* States before the lanes are prepared. Writing their machine code takes as long as 230 to 480 evaluations (four-bar to
 * suspension), and each state in lanes then saves half of one. */
enum { W = KMP_STAGE_LANES, PAYS = 500 };

/* Arguments of a call. */
typedef struct state_rows {
    const double *t, *q, *qd, *Q;
    size_t step;                     /* of t */
    const kempe_workspace_rows *out; /* NULL: accelerations are wanted */
    double *qdd, *lambda;
    bool lanes;
} state_rows;

/* -- preparation ------------------------------------------------------------------------------------- */

bool kmp_workspace_by_lanes(kempe_workspace *ws, int count)
{
    if (ws->eval->conditions.machine || ws->eval->nu || ws->system->force || count < W)
        return false;
    if (ws->many.stages.lanes)
        return true;
    ws->many.seen += (size_t)count;
    if (ws->many.seen < PAYS)
        return false;
    /* Makes the lanes. */
    kmp_state_lanes *many = &ws->many;
    const kmp_program *motion = ws->system->motion;
    many->size = 0;
    for (int k = 0; k < 3; k++) {
        many->count[k] = motion->outputs[KMP_STAGE_CLOSURE + k + 1] - motion->outputs[KMP_STAGE_CLOSURE + k];
        many->size += many->count[k];
    }
    return !ws->arena.failed &&
           (many->values ||
            KMP_ARENA_MAKE(&ws->arena, KMP_ROOM(double, W, &many->t), KMP_ROOM(double, W * ws->n, &many->q, &many->qd),
                           KMP_ROOM(double, W * many->size, &many->values))) &&
           kmp_stage_lanes_init(&many->stages, motion, ws->eval);
}

/* -- groups ------------------------------------------------------------------------------------------ */

/* Rows of W states as lanes: value k of state l at k W + l. */
static void to_lanes(int count, const double *rows, double *lanes)
{
    for (int k = 0; k < count; k++)
        for (int l = 0; l < W; l++)
            lanes[k * W + l] = rows[l * count + k];
}

/* Evaluates W states into `values`. false: some value may not be finite. */
static bool run_lanes(kempe_workspace *ws, const state_rows *in, size_t first)
{
    kmp_state_lanes *many = &ws->many;
    size_t at = first * (size_t)ws->n;
    int done = 0;
    for (size_t l = 0; l < W; l++)
        many->t[l] = in->t[(first + l) * in->step];
    to_lanes(ws->n, in->q + at, many->q);
    if (in->qd)
        to_lanes(ws->n, in->qd + at, many->qd);
    else
        memset(many->qd, 0, (size_t)(W * ws->n) * sizeof *many->qd);
    for (int k = 0; k < 3; k++) {
        const double *out = k == 0 ? kmp_stage_lanes_run(&many->stages, KMP_STAGE_CLOSURE, many->t, many->q, many->qd)
                                   : kmp_lanes_run(many->stages.lanes, KMP_STAGE_CLOSURE + k);
        if (!kmp_stage_lanes_finite(many->count[k], out))
            return false;
        /* The inverse; rows are `stride` apart. */
        int count = many->count[k];
        double *rows = many->values + done;
        for (int i = 0; i < count; i++)
            for (int l = 0; l < W; l++)
                rows[l * many->size + i] = out[i * W + l];
        done += many->count[k];
    }
    return true;
}

static void put_values(double *rows, int width, size_t state, const double *values)
{
    if (rows && width > 0)
        memcpy(rows + state * (size_t)width, values, (size_t)width * sizeof *rows);
}

/* Results of a state whose values the evaluator has. */
static kempe_status finish(kempe_workspace *ws, const state_rows *in, size_t state)
{
    if (!in->out) {
        bool reduced;
        KMP_TRY(kmp_workspace_accelerate(ws, kmp_row_at(in->Q, ws->n, (int)state), &reduced));
        put_forces(ws, kmp_row_at(in->qdd, ws->n, (int)state), kmp_row_at(in->lambda, ws->m, (int)state));
        return KEMPE_OK;
    }
    /* Writes the rows of a state from the evaluator. */
    const kempe_workspace_rows *out = in->out;
    const kmp_evaluator *eval = ws->eval;
    size_t n = (size_t)ws->n, m = (size_t)ws->m;
    if (out->mass)
        kmp_eval_dense_mass(eval, out->mass + state * n * n);
    if (out->jacobian)
        kmp_eval_dense_jacobian(eval, out->jacobian + state * m * n);
    put_values(out->bias, ws->n, state, eval->bias);
    put_values(out->h, ws->m, state, eval->h);
    put_values(out->jdqd, ws->m, state, eval->jdqd);
    return KEMPE_OK;
}

/* Gives the evaluator the values of a lane. */
static void lend_lane(kempe_workspace *ws, const double *q, int lane)
{
    kmp_evaluator *eval = ws->eval;
    const int *count = ws->many.count;
    const double *h = ws->many.values + (size_t)lane * (size_t)ws->many.size, *J = h + ws->m;
    kmp_eval_use_closure(eval, ws->many.t[lane], q, h, J,
                         ws->system->rheonomic ? J + ws->system->jacobian.count : NULL);
    kmp_eval_lend_motion(eval, h + count[0], h + count[0] + count[1]);
}

bool kmp_workspace_run_lanes(kempe_workspace *ws, const double *t, int t_step, const double *q, const double *qd)
{
    return run_lanes(ws, &(state_rows){.t = t, .q = q, .qd = qd, .step = t_step != 0}, 0);
}

void kmp_workspace_take_lane(kempe_workspace *ws, const double *q, const double *qd, int lane, bool keeps)
{
    const size_t at = (size_t)lane * (size_t)ws->n;
    workspace_keep_state(ws, ws->many.t[lane], q + at, qd + at);
    lend_lane(ws, ws->q, lane);
    ws->stale = !keeps;
    if (keeps)
        workspace_copy(ws);
}

/* A state in a lane after `run`. The workspace keeps it if it ends the call. */
static kempe_status finish_lane(kempe_workspace *ws, const state_rows *in, size_t state, int lane, bool last)
{
    const double *q = kmp_row_at(in->q, ws->n, (int)state);
    double t = ws->many.t[lane];
    lend_lane(ws, q, lane);
    ws->message[0] = '\0';
    if (last || !in->out)
        workspace_keep_state(ws, t, q, kmp_row_at(in->qd, ws->n, (int)state));
    kempe_status status = finish(ws, in, state);
    if (last || status != KEMPE_OK) {
        workspace_copy(ws);
        ws->stale = false;
    }
    return status;
}

kempe_status kmp_workspace_check_count(kempe_workspace *ws, int count)
{
    if (count >= 0)
        return KEMPE_OK;
    return KMP_WORKSPACE_REFUSE(ws, "the number of states is %d: at least 0 is expected", count);
}

bool kmp_workspace_interrupted(kempe_workspace *ws, bool before, int done, int count, const char *of)
{
    if (done == 0 || !kmp_interrupted_since(ws->system->context, before))
        return false;
    (void)kmp_workspace_fail(ws, "interrupted after %d of %d %s", done, count, of);
    return true;
}

kempe_status kmp_workspace_visit(kempe_workspace *ws, int count, kmp_state_visit *visit, const void *self, int *failed)
{
    const bool before = kmp_interrupt_taken(ws->system->context);
    kempe_status status = KEMPE_OK;
    int k = 0, done;
    ws->message[0] = '\0';
    ws->visits = true;
    for (; status == KEMPE_OK && k < count; k += status == KEMPE_OK ? done : done - 1) {
        done = 1;
        status = kmp_workspace_interrupted(ws, before, k, count, "states") ? KEMPE_STOPPED
                                                                           : visit(ws, self, k, count, &done);
    }
    ws->visits = false;
    if (failed)
        *failed = status == KEMPE_OK ? -1 : k;
    return status;
}

static kempe_status visit_state(kempe_workspace *ws, const void *self, int k, int count, int *done)
{
    const state_rows *in = self;
    const size_t state = (size_t)k;
    if (in->lanes && count - k >= W && run_lanes(ws, in, state)) {
        kempe_status status = KEMPE_OK;
        for (*done = 0; *done < W && status == KEMPE_OK; ++*done)
            status = finish_lane(ws, in, state + (size_t)*done, *done, k + *done + 1 == count);
        return status;
    }
    const double *q = kmp_row_at(in->q, ws->n, k), *qd = kmp_row_at(in->qd, ws->n, k), at = in->t[state * in->step];
    if (!in->out)
        return kempe_workspace_forward_dynamics(ws, at, q, qd, kmp_row_at(in->Q, ws->n, k),
                                                kmp_row_at(in->qdd, ws->n, k), kmp_row_at(in->lambda, ws->m, k));
    KMP_TRY(kempe_workspace_evaluate(ws, at, q, qd));
    return finish(ws, in, state);
}

kempe_status kempe_workspace_evaluate_states(kempe_workspace *ws, int count, const double *t, int t_step,
                                             const double *q, const double *qd, const kempe_workspace_rows *rows,
                                             int *failed)
{
    state_rows in = {.t = t, .q = q, .qd = qd, .step = t_step != 0, .out = rows};
    KMP_WANTED(NULL, ws, "workspace");
    if (!kmp_workspace_given(ws, "t", t) || !kmp_workspace_given(ws, "q", q) || !kmp_workspace_given(ws, "rows", rows))
        return KEMPE_E_ARGUMENT;
    in.lanes = kmp_workspace_by_lanes(ws, count);
    KMP_TRY(kmp_workspace_check_count(ws, count));
    return kmp_workspace_visit(ws, count, visit_state, &in, failed);
}

kempe_status kempe_workspace_forward_states(kempe_workspace *ws, int count, const double *t, int t_step,
                                            const double *q, const double *qd, const double *Q, double *qdd,
                                            double *lambda, int *failed)
{
    state_rows in = {.t = t, .q = q, .qd = qd, .Q = Q, .step = t_step != 0, .qdd = qdd, .lambda = lambda};
    KMP_WANTED(NULL, ws, "workspace");
    if (!kmp_workspace_given(ws, "t", t) || !kmp_workspace_given(ws, "q", q) || !kmp_workspace_given(ws, "qd", qd) ||
        !kmp_workspace_given(ws, "qdd", qdd))
        return KEMPE_E_ARGUMENT;
    in.lanes = !ws->by_bodies && kmp_workspace_by_lanes(ws, count) &&
               kmp_workspace_require_decisions(ws, "forward dynamics") == KEMPE_OK;
    KMP_TRY(kmp_workspace_check_count(ws, count));
    return kmp_workspace_visit(ws, count, visit_state, &in, failed);
}
