/* SPDX-License-Identifier: BSD-3-Clause */
/* The equations, and accelerations by them, at many states. The motion program runs at a group of states in the lanes
 * of vector registers, with the bits that it has at each of them alone. States that remain, and all states of models
 * with conditions, forces that depend on multipliers or a user-defined force, are evaluated one at a time. */
#include "constraints/evaluation/jacobian_and_mass.h"
#include "constraints/workspace/state_workspace.h"
#include "constraints/workspace/workspace_inside.h"
#include "dynamics/load_dependent.h"
#include <string.h>

/* States before the lanes are prepared. Writing their machine code takes as long as 230 to 480 evaluations (four-bar to
 * suspension), and each state in lanes then saves half of one. */
enum { W = KMP_STAGE_LANES, PAYS = 500 };

/* Arguments of a call. */
typedef struct state_rows {
    const double *t, *q, *qd, *Q;
    size_t step;                     /* of t */
    const kempe_workspace_rows *out; /* NULL: accelerations are wanted */
    double *qdd, *lambda;
} state_rows;

/* -- preparation ------------------------------------------------------------------------------------- */

/* Decides whether groups of states run in lanes, which are made once enough states have been seen. */
static bool by_lanes(kempe_workspace *ws, int count)
{
    if (ws->eval->changes || ws->eval->nu || ws->system->force || count < W)
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

static double *row_of(const double *rows, int width, size_t state)
{
    return rows ? (double *)rows + state * (size_t)width : NULL;
}

/* Results of a state whose values the evaluator has. */
static kempe_status finish(kempe_workspace *ws, const state_rows *in, size_t state)
{
    if (!in->out)
        return kmp_workspace_accelerate(ws, row_of(in->Q, ws->n, state), row_of(in->qdd, ws->n, state),
                                        row_of(in->lambda, ws->m, state));
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

/* A state in a lane after `run`. The workspace keeps it if it ends the call. */
static kempe_status finish_lane(kempe_workspace *ws, const state_rows *in, size_t state, int lane, bool last)
{
    const double *q = row_of(in->q, ws->n, state);
    double t = ws->many.t[lane];
    /* Gives the evaluator the values of a lane. */
    kmp_evaluator *eval = ws->eval;
    const int *count = ws->many.count;
    const double *h = ws->many.values + (size_t)lane * (size_t)ws->many.size, *J = h + ws->m;
    kmp_eval_use_closure(eval, t, q, h, J, ws->system->rheonomic ? J + ws->system->jacobian.count : NULL);
    kmp_eval_lend_motion(eval, h + count[0], h + count[0] + count[1]);
    ws->message[0] = '\0';
    if (last || !in->out)
        kmp_workspace_keep_state(ws, t, q, row_of(in->qd, ws->n, state));
    kempe_status status = finish(ws, in, state);
    if (last || status != KEMPE_OK) {
        kmp_workspace_copy(ws);
        ws->stale = false;
    }
    return status;
}

static kempe_status visit_states(kempe_workspace *ws, const state_rows *in, bool lanes, int count, int *failed)
{
    kempe_status status = KEMPE_OK;
    int done = 0;
    if (count < 0)
        return kmp_fail(ws->system->context, KEMPE_E_ARGUMENT, "the number of states is %d: at least 0 is expected",
                        count);
    ws->message[0] = '\0';
    ws->visits = true;
    while (status == KEMPE_OK && done < count) {
        int group = lanes && count - done >= W && run_lanes(ws, in, (size_t)done) ? W : 0;
        for (int l = 0; l < group && status == KEMPE_OK; l++, done++)
            status = finish_lane(ws, in, (size_t)done, l, done + 1 == count);
        if (group > 0)
            continue;
        const size_t state = (size_t)done++;
        const double *q = row_of(in->q, ws->n, state), *qd = row_of(in->qd, ws->n, state), at = in->t[state * in->step];
        if (!in->out)
            status = kempe_workspace_forward_dynamics(ws, at, q, qd, row_of(in->Q, ws->n, state),
                                                      row_of(in->qdd, ws->n, state), row_of(in->lambda, ws->m, state));
        else if ((status = kempe_workspace_evaluate(ws, at, q, qd)) == KEMPE_OK)
            status = finish(ws, in, state);
    }
    ws->visits = false;
    if (failed)
        *failed = status == KEMPE_OK ? -1 : done - 1;
    return status;
}

kempe_status kempe_workspace_evaluate_states(kempe_workspace *ws, int count, const double *t, int t_step,
                                             const double *q, const double *qd, const kempe_workspace_rows *rows,
                                             int *failed)
{
    const state_rows in = {.t = t, .q = q, .qd = qd, .step = t_step != 0, .out = rows};
    KMP_WANTED(NULL, ws, "workspace");
    if (!kmp_workspace_given(ws, "t", t) || !kmp_workspace_given(ws, "q", q) || !kmp_workspace_given(ws, "rows", rows))
        return KEMPE_E_ARGUMENT;
    return visit_states(ws, &in, by_lanes(ws, count), count, failed);
}

kempe_status kempe_workspace_forward_states(kempe_workspace *ws, int count, const double *t, int t_step,
                                            const double *q, const double *qd, const double *Q, double *qdd,
                                            double *lambda, int *failed)
{
    const state_rows in = {.t = t, .q = q, .qd = qd, .Q = Q, .step = t_step != 0, .qdd = qdd, .lambda = lambda};
    KMP_WANTED(NULL, ws, "workspace");
    if (!kmp_workspace_given(ws, "t", t) || !kmp_workspace_given(ws, "q", q) || !kmp_workspace_given(ws, "qd", qd) ||
        !kmp_workspace_given(ws, "qdd", qdd))
        return KEMPE_E_ARGUMENT;
    bool lanes =
        !ws->by_bodies && by_lanes(ws, count) && kmp_refuse_contacts(ws->system->model, "forward dynamics") == KEMPE_OK;
    return visit_states(ws, &in, lanes, count, failed);
}
