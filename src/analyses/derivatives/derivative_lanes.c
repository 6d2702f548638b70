/* SPDX-License-Identifier: BSD-3-Clause */
/* First the equations of all lanes, then their accelerations state by state, each with separate factors; then the
 * programs of derivatives in all lanes, with these accelerations. */
#include "analyses/derivatives/derivative_lanes.h"
#include "analyses/derivatives/state_derivatives.h"
#include <string.h>

/* States before the lanes are prepared: see state_workspace.c. */
enum { W = KMP_STAGE_LANES, PAYS = 500, STAGE = 1 };

/* -- preparation ----------------------------------------------------------------------------------------- */

static int outputs_of(const kmp_program *program)
{
    return program ? program->outputs[STAGE + 1] - program->outputs[STAGE] : 0;
}

static bool make(kempe_workspace *ws, kmp_derivative_lanes *x)
{
    const kmp_program *program = ((kmp_state_derivatives *)ws->derivatives.self)->tangents.tangent.program;
    const int n = ws->n, m = ws->m;
    x->tangent_count = outputs_of(program);
    bool ok = KMP_ARENA_MAKE(&x->arena, KMP_ROOM(double, W *n, &x->qdd), KMP_ROOM(double, W *m, &x->lambda),
                             KMP_ROOM(double, W *(n + m), &x->answer),
                             KMP_ROOM(double, W * x->tangent_count, &x->tangent_rows)) &&
              kmp_stage_lanes_init(&x->tangents, program, ws->eval);
    for (int l = 0; ok && l < W; l++)
        ok = kmp_reduction_init(&x->red[l], ws->eval, &ws->part) == KEMPE_OK;
    return ok;
}

static bool make_named(kempe_workspace *ws, kmp_derivative_lanes *x)
{
    const kmp_slopes *slopes = ((kmp_state_derivatives *)ws->derivatives.self)->slopes;
    const kmp_program *equations = slopes ? slopes->equations.formulas.program : NULL,
                      *outputs = slopes ? slopes->outputs.formulas.program : NULL;
    const double *parameters = slopes ? slopes->system->parameters : NULL;
    x->name_count = outputs_of(equations);
    x->output_count = outputs_of(outputs);
    return KMP_ARENA_MAKE(&x->named, KMP_ROOM(double, W * x->name_count, &x->name_rows),
                          KMP_ROOM(double, W * x->output_count, &x->output_rows)) &&
           kmp_stage_lanes_init_varied(&x->equations, equations, ws->eval, parameters) &&
           kmp_stage_lanes_init_varied(&x->outputs, outputs, ws->eval, parameters);
}

void kmp_derivative_lanes_forget(kmp_derivative_lanes *lanes)
{
    kmp_stage_lanes_free(&lanes->equations);
    kmp_stage_lanes_free(&lanes->outputs);
    kmp_arena_free(&lanes->named);
    lanes->names_ready = false;
}

void kmp_derivative_lanes_free(kmp_derivative_lanes *lanes)
{
    kmp_derivative_lanes_forget(lanes);
    kmp_stage_lanes_free(&lanes->tangents);
    for (int l = 0; l < W; l++)
        kmp_reduction_free(&lanes->red[l]);
    kmp_arena_free(&lanes->arena);
    lanes->ready = false;
}

bool kmp_derivative_lanes_by(kempe_workspace *ws, int count)
{
    kmp_state_derivatives *d = ws->derivatives.self;
    /* Kept pivots would depend on other states than one at a time. */
    if (!d || !ws->chosen || kmp_block_keeps_pivots(ws->red.block) || !kmp_workspace_by_lanes(ws, count))
        return false;
    kmp_derivative_lanes *x = &d->many;
    x->seen += (size_t)count;
    if (x->seen < PAYS)
        return false;
    if (!x->ready)
        x->ready = make(ws, x);
    if (x->ready && !x->names_ready)
        x->names_ready = make_named(ws, x);
    if (x->ready && x->names_ready)
        return true;
    kmp_derivative_lanes_free(x); /* no memory: one at a time */
    return false;
}

/* -- groups ---------------------------------------------------------------------------------------------- */

/* Exchanges the reduction of the workspace with the one of a lane. */
static void exchange(kempe_workspace *ws, kmp_derivative_lanes *x, int lane)
{
    const kmp_reduction other = x->red[lane];
    x->red[lane] = ws->red;
    ws->red = other;
}

/* Accelerations and multipliers of a lane, by its reduction. */
static bool accelerate(kempe_workspace *ws, kmp_derivative_lanes *x, const double *q, const double *qd, const double *Q,
                       int lane, bool closed)
{
    bool reduced = false;
    kmp_workspace_take_lane(ws, q, qd, lane, false);
    exchange(ws, x, lane);
    const bool solved =
        kmp_workspace_accelerate(ws, Q ? Q + (ptrdiff_t)lane * ws->n : NULL, &reduced) == KEMPE_OK && reduced &&
        (!closed || kmp_workspace_require_closed(ws, "derivatives along closed motions", ws->many.t[lane]) == KEMPE_OK);
    exchange(ws, x, lane);
    if (!solved)
        return false;
    memcpy(x->answer + (ptrdiff_t)lane * (ws->n + ws->m), ws->answer, (size_t)(ws->n + ws->m) * sizeof *ws->answer);
    for (int i = 0; i < ws->n; i++)
        x->qdd[i * W + lane] = ws->answer[i];
    for (int i = 0; i < ws->m; i++)
        x->lambda[i * W + lane] = ws->answer[ws->n + i];
    return true;
}

/* Evaluates a program at all lanes, into rows. */
static void run(kempe_workspace *ws, const kmp_derivative_lanes *x, kmp_stage_lanes *of, int count, double *rows)
{
    if (!of->lanes || count == 0)
        return;
    kmp_lanes_set(of->lanes, KMP_IN_QDD, x->qdd);
    kmp_lanes_set(of->lanes, KMP_IN_LAMBDA, x->lambda);
    kmp_stage_lanes_rows(count, kmp_stage_lanes_run(of, STAGE, ws->many.t, ws->many.q, ws->many.qd), rows);
}

bool kmp_derivative_lanes_run(kempe_workspace *ws, const double *t, int t_step, const double *q, const double *qd,
                              const double *Q, bool closed)
{
    kmp_state_derivatives *d = ws->derivatives.self;
    kmp_derivative_lanes *x = &d->many;
    if (!kmp_workspace_run_lanes(ws, t, t_step, q, qd))
        return false;
    for (int l = 0; l < W; l++)
        if (!accelerate(ws, x, q, qd, Q, l, closed))
            return false;
    run(ws, x, &x->tangents, x->tangent_count, x->tangent_rows);
    run(ws, x, &x->equations, x->name_count, x->name_rows);
    run(ws, x, &x->outputs, x->output_count, x->output_rows);
    return true;
}

void kmp_derivative_lanes_take(kempe_workspace *ws, const double *q, const double *qd, int lane, bool keeps,
                               kmp_derivative_point *point)
{
    kmp_state_derivatives *d = ws->derivatives.self;
    kmp_derivative_lanes *x = &d->many;
    const ptrdiff_t l = lane;
    kmp_workspace_take_lane(ws, q, qd, lane, keeps);
    exchange(ws, x, lane);
    memcpy(ws->answer, x->answer + l * (ws->n + ws->m), (size_t)(ws->n + ws->m) * sizeof *ws->answer);
    *point = (kmp_derivative_point){.reduced = true, .tangents = x->tangent_rows + l * x->tangent_count};
    if (d->names > 0)
        d->slopes->equations.value = x->name_rows + l * x->name_count;
    if (d->outputs > 0)
        point->shown = d->slopes->outputs.value = x->output_rows + l * x->output_count;
}

void kmp_derivative_lanes_give_back(kempe_workspace *ws, int lane)
{
    exchange(ws, &((kmp_state_derivatives *)ws->derivatives.self)->many, lane);
}
