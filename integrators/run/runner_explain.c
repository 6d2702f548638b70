/* SPDX-License-Identifier: BSD-3-Clause */
/* Reason of a run's end, as a sentence. */
#include "integrators/run/runner_explain.h"
#include "base/memory.h"
#include "constraints/evaluation/evaluator.h"
#include "constraints/evaluation/load_multipliers.h"
#include "constraints/evaluation/state_ends.h"
#include "constraints/partition/singularity_causes.h"
#include "constraints/tolerances.h"
#include "integrators/run/runner.h"
#include "integrators/run/runner_center.h"
#include "linalg/dense/factors.h"
#include "model/data/model.h"
#include <float.h>
#include <math.h>

const char *kmp_runner_driven_by(const kempe_system *s, int row)
{
    const char *name = NULL;
    int count = 0;
    for (int e = 0; e < s->jacobian.count; e++)
        if (s->jacobian.row[e] == row && ++count)
            name = s->model->motions[s->jacobian.col[e]].name;
    return count == 1 ? name : NULL;
}

/* Names the largest coordinate if its rounding is above the tolerance, as of an angle after many turns: the others then
 * have errors that no smaller step reduces. */
static void explain_rounding(const kmp_runner *run, kmp_text *text)
{
    int largest = 0;
    for (int i = 1; i < kmp_model_coordinates(run->s->model); i++)
        if (fabs(run->room.state[i]) > fabs(run->room.state[largest]))
            largest = i;
    const double rounding = DBL_EPSILON * fabs(run->room.state[largest]);
    const kmp_motion *motion = &run->s->model->motions[largest];
    const char *unit = motion->rotation ? "rad" : "m";
    if (rounding > run->spec.atol)
        kmp_text_printf(text,
                        "; '%s' is %.3g %s, which is rounded to %.1g %s, and atol is %g: use a larger rtol and atol",
                        motion->name, run->room.state[largest], unit, rounding, unit, run->spec.atol);
}

void kmp_runner_explain_position(kmp_runner *run, kmp_text *text)
{
    if (!run->formulation || !run->solver || run->s->n == 0)
        return;
    if (run->solver->t > run->spec.t_start && kmp_runner_position(run, run->solver->t, run->room.state) == KEMPE_OK) {
        kmp_angles_explain(run->s->model, run->room.state, text);
        explain_rounding(run, text);
    }
}

int kmp_runner_lock(kmp_runner *run, double t)
{
    if (!run->formulation || !run->solver || !run->s->rheonomic || kmp_runner_place(run, t) != KEMPE_OK)
        return -1;
    bool open = kmp_eval_residual(run->eval) > KMP_CLOSED_ENOUGH; /* beyond a dead centre no motion closes it */
    bool been = run->margin.tried > 0 && open;
    return kmp_rank_margin_lock(&run->margin, run->eval, been);
}

/* Reports a drive that demands more than the mechanism can do; false if that is not the cause. Integrators stop up to
 * some 1e-7 of the time before a dead centre. */
static bool explain_lock(kmp_runner *run, kmp_text *text, double t)
{
    int row = kmp_runner_lock(run, t);
    if (row < 0)
        return false;
    const char *name = kmp_runner_driven_by(run->s, row);
    kmp_text_printf(text, "the mechanism reaches a limit position (dead centre) at t = %.7g s, beyond which ", t);
    if (name)
        kmp_text_printf(text, "constraint equation '%s' cannot move the driven coordinate '%s'", run->s->row_names[row],
                        name);
    else
        kmp_text_printf(text, "constraint equation '%s' cannot follow its prescribed motion", run->s->row_names[row]);
    return true;
}

/* Reports a condition that ends runs and holds at the state. */
static bool explain_end(kmp_runner *run, double t, const double *q, const double *qd, kmp_text *text)
{
    int from = 0;
    const int k = kmp_eval_next_end(run->eval, KMP_ENDS_OF_RUN, t, q, qd, NULL, NULL, &from);
    if (k >= 0)
        kmp_put_end(text, run->s, k, t);
    return k >= 0;
}

kempe_status kmp_runner_fail_unsettled(kmp_runner *run, double t, const double *q, const double *qd)
{
    kmp_text text = {0};
    if (!explain_end(run, t, q, qd, &text))
        return kmp_fail_unsettled(run->eval);
    return kmp_fail_text(run->s->context, KEMPE_E_FAILED, &text);
}

/* Names implicit variables of the model: without a solution nothing can be evaluated. */
static void name_unknowns(const kmp_runner *run, kmp_text *text)
{
    const kempe_model *model = run->s->model;
    const char *before = "; possibly the implicit variables have no solution there: ";
    for (int k = 0; k < model->unknowns_count; k++)
        if (model->unknowns[k].count > 0) {
            kmp_text_printf(text, "%s'%s'", before, model->unknowns[k].name);
            before = ", ";
        }
}

/* The least pivot of M, which the evaluator makes, scaled to a unit diagonal; 0: it is not positive definite, or there
 * is no memory. */
static double least_pivot(kmp_evaluator *eval, double t, const double *q)
{
    const kmp_pattern *mass = &eval->system->mass;
    const int n = eval->n;
    double *a = KMP_NEW(double, n *n), least = 0;
    kmp_eval_closure(eval, t, q);
    kmp_eval_mass(eval);
    for (int e = 0; a && e < mass->count; e++)
        a[mass->row[e] + n * mass->col[e]] = a[mass->col[e] + n * mass->row[e]] = eval->mass[e];
    for (int i = 0; a && i < n; i++)
        for (int k = 0; k < n; k++)
            if (i != k)
                a[i + n * k] /= sqrt(fabs(a[i + n * i] * a[k + n * k]));
    for (int i = 0; a && i < n; i++)
        a[i + n * i] = a[i + n * i] > 0 ? 1 : -1;
    if (a && kmp_cholesky_factor(n, a) == 0) {
        least = 1;
        for (int i = 0; i < n; i++)
            least = fmin(least, a[i + n * i] * a[i + n * i]);
    }
    kmp_free(a);
    return least;
}

/* Names a flexible body whose terms of second order have no inertia: where it turns about its own axis M is not
 * positive beyond a deflection of the size of its sections. It is the cause where M without its deflection is far from
 * that. */
static void name_first(kmp_runner *run, double t, double *q, double here, kmp_text *text)
{
    const kempe_model *model = run->s->model;
    for (int f = 0; f < model->flexible_count; f++) {
        const kmp_flexible *flexible = &model->flexibles[f];
        if (flexible->stiffening != KMP_STIFFENING_FIRST)
            continue;
        memset(q + flexible->first, 0, (size_t)flexible->count * sizeof *q);
        if (here < KMP_INERTIA_LOST * least_pivot(run->eval, t, q)) {
            kmp_text_printf(
                text,
                "; the mass matrix is hardly positive there, because body '%s' has 'stiffening: first', which leaves "
                "inertia out: use '%s'",
                model->bodies[flexible->body].name, flexible->file ? "none" : "full");
            return;
        }
    }
}

void kmp_runner_explain_inertia(kmp_runner *run, kmp_text *text)
{
    const kempe_model *model = run->s->model;
    kmp_evaluator *eval = run->eval;
    if (model->flexible_count == 0 || !run->formulation || !run->solver || kmp_eval_goes_by_links(eval) ||
        kmp_eval_add_composite(eval) != KEMPE_OK)
        return;
    const bool by_bodies = eval->by_bodies;
    const double t = run->solver->t;
    const size_t n = (size_t)run->s->n;
    double *q = KMP_NEW(double, 2 * n), *straight = q + n;
    const bool found = q && kmp_runner_position(run, t, q) == KEMPE_OK;
    kmp_eval_set_by_bodies(eval, false);
    if (found) {
        const double here = least_pivot(eval, t, q);
        const size_t before = text->length;
        memcpy(straight, q, n * sizeof *q);
        for (int f = 0; f < model->flexible_count; f++)
            memset(straight + model->flexibles[f].first, 0, (size_t)model->flexibles[f].count * sizeof *q);
        if (here < KMP_INERTIA_LEFT)
            (void)kmp_put_massless(eval, &run->part, t, straight,
                                   "; hardly any mass is moved there, since without deformation ", text);
        if (text->length == before)
            name_first(run, t, q, here, text);
    }
    kmp_eval_set_by_bodies(eval, by_bodies);
    kmp_free(q);
}

bool kmp_runner_reason(kmp_runner *run, const char *otherwise, double t, kmp_text *text)
{
    const char *said = kempe_context_message(run->s->context);
    if (run->formulation && run->formulation->explain && run->formulation->reason.length == 0 && !*said)
        run->formulation->explain(run->formulation);
    const double *begin = run->room.state; /* the state at the start */
    if (t == run->spec.t_start && begin && run->eval && explain_end(run, t, begin, begin + run->s->n, text))
        return false;
    bool prepared = run->solver || !*said; /* a failed preparation has set its own message */
    if (t == run->spec.t_start && begin && run->eval && prepared &&
        kmp_put_not_finite(run->eval, t, begin, begin + run->s->n, text)) {
        name_unknowns(run, text);
        return false;
    }
    bool locks = explain_lock(run, text, t);
    if (!locks && run->formulation && run->formulation->reason.length)
        kmp_text_put(text, run->formulation->reason.s);
    else if (!locks && *said)
        kmp_text_put(text, said);
    else if (!locks && kmp_is_unsettled(run->eval))
        kmp_put_unsettled(run->eval, text);
    else if (!locks)
        kmp_text_printf(text, "%s at t = %.9g s", otherwise, t);
    if (!locks && run->formulation && !kmp_is_unsettled(run->eval) &&
        !(run->events.tracker && run->events.tracker->stuck))
        name_unknowns(run, text);
    kmp_runner_explain_position(run, text);
    if (!locks)
        kmp_runner_explain_inertia(run, text);
    return locks;
}

kempe_status kmp_runner_give_up(kmp_runner *run, kempe_status status, const char *otherwise, double t)
{
    kmp_text text = {0};
    if (status != KEMPE_E_FAILED)
        return status;
    if (run->reason)
        return run->locks ? KEMPE_STOPPED : KEMPE_E_FAILED;
    if (kmp_memory_failures() != run->memory_failures) {
        kmp_context_clear(run->s->context); /* drops earlier messages */
        return kmp_fail_memory(run->s->context);
    }
    run->locks = kmp_runner_reason(run, otherwise, t, &text);
    run->reason = kmp_text_take(&text);
    KMP_TRY(kmp_made(run->s->context, run->reason));
    return run->locks ? KEMPE_STOPPED : KEMPE_E_FAILED;
}
