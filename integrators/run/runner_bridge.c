/* SPDX-License-Identifier: BSD-3-Clause */
/* A row within the last step that its formulation cannot complete: inside a step its u, or the rows it keeps, may be
 * singular although they are good at both ends. The step is then repeated from its start to the time of the row by the
 * projected formulation, which needs no u, with rows chosen again as often as necessary. */
#include "integrators/run/runner_bridge.h"
#include "base/memory.h"
#include "integrators/decide/dropped_rows.h"
#include "integrators/run/methods.h"
#include "integrators/run/runner.h"
#include "integrators/run/runner_start.h"
#include <math.h>
#include <string.h>

/* Largest number of its steps. */
enum { MOST_STEPS = 1000 };

typedef struct bridge {
    kmp_runner *run;
    double t, end, work;
    double *q, *qd; /* at t */
    kmp_partition part;
    kmp_rank_margin margin;
    kmp_formulation *formulation;
    const kmp_solver_kind *kind;
    kmp_solver *solver;
    double *y;
    int steps;
} bridge;

static void tear_down(bridge *b)
{
    if (b->solver)
        b->kind->release(b->solver);
    if (b->formulation)
        b->formulation->release(b->formulation);
    kmp_rank_margin_free(&b->margin);
    kmp_partition_free(&b->part);
    b->solver = NULL;
    b->formulation = NULL;
    b->y = NULL;
}

/* Makes rows, formulation and integrator for the present state. */
static bool set_up(bridge *b)
{
    kmp_runner *run = b->run;
    kmp_eval_closure(run->eval, b->t, b->q);
    if (kmp_partition_of_rank(&b->part, run->s, run->eval->jacobian, run->margin.r, NULL, 0) != KEMPE_OK ||
        !kmp_rank_margin_init(&b->margin, run->s, &b->part))
        return false;
    kmp_rank_margin_ignore(&b->margin);
    kmp_formulation_start given = kmp_runner_given(run, b->t, b->q, b->qd, b->work);
    given.part = &b->part;
    given.margin = &b->margin;
    b->formulation = kmp_formulation_projected.create(&kmp_formulation_projected, &given);
    if (!b->formulation)
        return false;
    b->kind = kmp_solver_find("dop853");
    b->y = KMP_ARENA_NEW(&b->formulation->arena, double, b->formulation->size);
    b->solver = b->kind->create(b->kind, &(kmp_solver_setup){.context = run->s->context,
                                                             .ode = &b->formulation->ode,
                                                             .dae = &b->formulation->dae,
                                                             .tolerance = {run->spec.rtol, b->formulation->atol}});
    return b->solver && b->y && b->kind->start(b->solver, b->t, b->formulation->y, NULL, b->end, 0) == KEMPE_OK;
}

/* Makes steps until the end, or until other rows are needed. false: they failed. */
static bool march(bridge *b)
{
    bool good = true, stays = true;
    while (good && stays && b->t < b->end) {
        good = b->steps++ < MOST_STEPS && b->kind->step(b->solver) == KEMPE_OK;
        b->t = b->solver->t;
        if (!good || b->part.r == b->part.m)
            continue;
        (void)kmp_rank_margin_after_step(&b->margin, b->run->eval, b->t);
        kmp_rank_margin_stand(&b->margin);
        stays = kmp_dropped_judge(b->margin.rows) == KMP_KEPT_WELL;
    }
    return good;
}

/* Repeats the step from `start` to t, in `row`; false: it failed. */
static bool repeat(kmp_runner *run, double start, double t, double *row, double *work)
{
    kmp_formulation *own = run->formulation;
    bridge b = {.run = run, .t = start, .end = t, .q = row, .qd = row + run->s->n};
    bool found = run->kind->dense(run->solver, start, run->y, run->yp) == KEMPE_OK &&
                 own->row(own, start, run->y, b.q, b.qd, NULL, NULL, &b.work) == KMP_GO;
    found = found && kmp_eval_add_composite(run->eval) == KEMPE_OK;
    kmp_eval_set_by_bodies(run->eval, false);
    while (found && b.t < t) {
        found = set_up(&b) && march(&b) && b.kind->dense(b.solver, b.t, b.y, NULL) == KEMPE_OK &&
                kmp_formulation_row(b.formulation, b.t, b.y, row, &b.work) == KMP_GO;
        tear_down(&b);
    }
    *work = b.work;
    return found;
}

bool kmp_runner_bridge(kmp_runner *run, double t, double *row, double *work)
{
    kmp_formulation *own = run->formulation;
    size_t size = 3 * (size_t)run->s->n + (size_t)run->s->m;
    double *state = KMP_NEW(double, size), start = kmp_runner_t_old(run), done;
    kmp_text why = own->reason;
    own->reason = (kmp_text){0};
    bool by_bodies = run->eval->by_bodies;
    bool known = kmp_formulation_find(run->method->formulation, run->method->form) ==
                 run->method; /* others have other unknowns */
    bool found = state && start < t && known && repeat(run, start, t, state, &done);
    kmp_eval_set_by_bodies(run->eval, by_bodies);
    if (found) {
        memcpy(row, state, size * sizeof *row);
        *work = done;
    }
    kmp_free(state);
    kmp_text_free(&own->reason);
    if (!found) {
        own->reason = why;
        return false;
    }
    kmp_context_clear(run->s->context);
    kmp_run_log_add(run->log, "row", t, NAN, NAN,
                    "%s: the step from t = %.9g was repeated up to this time with the projected formulation",
                    why.length ? why.s : "the state could not be completed", start);
    kmp_text_free(&why);
    return true;
}
