/* SPDX-License-Identifier: BSD-3-Clause */
/* Formulations that a run has left and may return to. Their programs depend on rows, coordinates and charts, not on the
 * state; `resume` puts them at another one. */
#include "integrators/run/runner_visits.h"
#include "constraints/closing/rounding.h"
#include "constraints/evaluation/evaluator.h"
#include "constraints/evaluation/intended_rank.h"
#include "integrators/run/runner.h"
#include "integrators/run/runner_integrator.h"
#include "integrators/run/runner_start.h"

#include <string.h>

/* -- leaving ------------------------------------------------------------------------------------------- */

/* Takes the work of a formulation that continues off the work of the ones before, in which it has been counted. */
static void take_off(kmp_runner *run)
{
    kmp_run_report own = {0}, *all = &run->before;
    kmp_runner_add_report(run, &own);
    all->steps -= own.steps;
    all->rejected -= own.rejected;
    all->refused -= own.refused;
    all->rhs -= own.rhs;
    all->newton -= own.newton;
    all->jacobians -= own.jacobians;
    all->factorizations -= own.factorizations;
    all->exchanges -= own.exchanges;
}

static void release(kmp_visit *visit)
{
    if (visit->choice.other)
        visit->choice.other_kind->release(visit->choice.other);
    visit->kind->release(visit->solver);
    visit->formulation->release(visit->formulation);
}

static void remove_visit(kmp_runner *run, int k)
{
    run->resting.count--;
    memmove(&run->resting.visit[k], &run->resting.visit[k + 1],
            (size_t)(run->resting.count - k) * sizeof *run->resting.visit);
}

void kmp_runner_leave(kmp_runner *run, bool held)
{
    const kmp_visit visit = {.formulation = run->formulation,
                             .method = run->method,
                             .y = run->room.y,
                             .yp = run->room.yp,
                             .kind = run->kind,
                             .solver = run->solver,
                             .choice = run->choice,
                             .t = kmp_runner_t(run)};
    if (held && !run->resting.visit)
        run->resting.visit = KMP_ARENA_NEW(&run->arena, kmp_visit, KMP_MOST_VISITS);
    /* It may be resumed elsewhere if it has not failed, and needs no exact closing of dropped rows. */
    const bool rests = held && run->resting.visit && run->formulation->rests && run->formulation->reason.length == 0 &&
                       !run->change_point.near && !run->spec.kind && !kmp_rounding_of(run->s);
    kmp_runner_add_report(run, &run->before);
    kmp_runner_end_formulation(run);
    if (!rests) {
        kmp_runner_release_integrators(run);
        run->formulation->release(run->formulation);
    } else {
        if (run->resting.count == KMP_MOST_VISITS) {
            release(&run->resting.visit[0]);
            remove_visit(run, 0);
        }
        run->formulation->rested = true;
        run->resting.visit[run->resting.count++] = visit;
    }
    run->formulation = NULL;
    run->solver = run->choice.other = NULL;
    run->room.y = run->room.yp = NULL;
}

void kmp_runner_forget_visits(kmp_runner *run)
{
    while (run->resting.count > 0)
        release(&run->resting.visit[--run->resting.count]);
}

/* -- returning ----------------------------------------------------------------------------------------- */

static bool find_visit(const kmp_runner *run, kmp_visit *visit, int *k)
{
    const kmp_partition *b = &run->part;
    for (*k = run->resting.count - 1; *k >= 0; --*k) {
        *visit = run->resting.visit[*k];
        const kmp_partition *a = visit->formulation->part;
        if (visit->method == run->method && a->p == b->p && a->r == b->r &&
            memcmp(a->u, b->u, (size_t)a->p * sizeof *a->u) == 0 &&
            memcmp(a->rows, b->rows, (size_t)a->r * sizeof *a->rows) == 0)
            return true;
    }
    return false;
}

/* The formulation at the state; false: it cannot continue there. */
static bool resume(kmp_runner *run, const kmp_visit *visit, double t)
{
    const double *q = run->room.state, *qd = q + run->s->n;
    kmp_formulation *formulation = visit->formulation;
    kmp_eval_drop(run->eval, run->part.m - run->part.r, run->part.redundant);
    if (formulation->resume(formulation, t, q, qd, visit->y, visit->yp) != KMP_GO)
        return false;
    if (run->s->dissipative)
        visit->y[formulation->size - 1] = run->balance.work;
    return true;
}

kempe_status kmp_runner_return(kmp_runner *run, double t, bool *returned)
{
    kmp_visit visit;
    int k;
    *returned = false;
    if (run->change_point.near || !find_visit(run, &visit, &k))
        return KEMPE_OK;
    remove_visit(run, k);
    KMP_TRY(kmp_runner_take_dynamics(run));
    *returned = run->eval->by_bodies == visit.formulation->by_bodies &&
                run->eval->by_products == visit.formulation->by_products && kmp_runner_suits(run, &visit) &&
                resume(run, &visit, t);
    if (!*returned) {
        kmp_context_clear(run->s->context);
        release(&visit);
        return KEMPE_OK;
    }
    run->formulation = visit.formulation;
    run->room.y = visit.y;
    run->room.yp = visit.yp;
    if (run->events.tracker)
        run->events.tracker->search.ready = false;
    run->solver = visit.solver;
    run->choice.other = visit.choice.other;
    take_off(run);
    return kmp_runner_return_to_integrator(run, t, &visit);
}
