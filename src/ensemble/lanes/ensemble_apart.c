/* SPDX-License-Identifier: BSD-3-Clause */
/* Separate runs of an instance: from its start to its end if lanes cannot run it; or from where a lane left it to where
 * lanes can take it back. A part begins and ends where the instance alone says so. */
#include "ensemble/lanes/ensemble_apart.h"
#include "base/memory.h"
#include "constraints/closing/assembly.h"
#include "constraints/evaluation/charts.h"
#include "constraints/evaluation/evaluator.h"
#include "constraints/tolerances.h"
#include "ensemble/lanes/ensemble_engine.h"
#include "ensemble/lanes/ensemble_inside.h"
#include "ensemble/lanes/ensemble_measure.h"
#include "ensemble/lanes/ensemble_start.h"
#include "ensemble/lanes/ensemble_within.h"
#include "integrators/run/events.h"
#include "integrators/run/runner.h"
#include "integrators/run/runner_change.h"
#include "integrators/run/runner_start.h"
#include "integrators/run/sampler.h"
#include <math.h>
#include <string.h>

/* Least steps of a part: its programs cost as much as some of them. Steps between two looks at the margin. */
enum { PART_STEPS = 8, PART_LOOKS = 4 };

/* -- to the end -------------------------------------------------------------------------------------- */

static void add_work(kmp_ensemble_result *result, const kmp_run_report *report)
{
    result->steps += report->steps;
    result->rejected += report->rejected;
    result->refused += report->refused;
    result->rhs += report->rhs;
    result->exchanges += report->exchanges;
}

/* Makes a step and takes it into the account of the instance. */
static kempe_status make_step(kmp_engine *e, int i, kmp_runner *run)
{
    kmp_text why = {0};
    KMP_TRY(kmp_runner_step(run));
    if (run->crossing && kmp_event_tracker_is_undecided(run->crossing, &why)) {
        run->reason = kmp_text_take(&why);
        return KEMPE_E_FAILED;
    }
    return kmp_run_measure(e, i, run) ? KEMPE_OK : KEMPE_E_FAILED; /* the row gave the reason */
}

/* Writes the result of an instance whose run has come to its end. */
static kempe_status finish(kmp_engine *e, int i, kmp_runner *run, kempe_status status)
{
    kmp_ensemble_result *result = &e->results[i];
    kmp_run_report report;
    double *row = KMP_NEW(double, 3 * e->n + e->m), work;
    kmp_runner_report(run, &report);
    result->status = status = report.requested ? KEMPE_OK : status;
    result->reason = report.reason;
    result->t = report.t;
    add_work(result, &report);
    if (run->eval)
        kmp_eval_set_modes(e->eval, kmp_runner_modes(run));
    if (row && run->solver && kmp_runner_row(run, report.t, row, &work) == KEMPE_OK) {
        if (kmp_runner_inputs(run)->past)
            kmp_engine_hold_inputs(e, kmp_runner_inputs(run));
        kmp_eval_closure(e->eval, report.t, row);
        kmp_instance_judge(e, i, report.t, row, row + e->n, work);
        if (status == KEMPE_OK)
            kmp_instance_measured(e, NULL, i, report.t, row);
        kmp_engine_hold_inputs(e, NULL);
    }
    kmp_free(row);
    return !row ? kmp_fail_memory(e->context) : status == KEMPE_E_MEMORY ? status : KEMPE_OK;
}

/* Reports the reason of a failed start. */
static kempe_status fail_alone(kmp_engine *e, int i, kempe_status status)
{
    if (status == KEMPE_E_MEMORY)
        return status;
    e->results[i].status = KEMPE_E_FAILED;
    e->results[i].reason = kmp_strdup(kempe_context_message(e->context));
    kmp_context_clear(e->context);
    return e->results[i].reason ? KEMPE_OK : kmp_fail_memory(e->context);
}

kempe_status kmp_instance_alone(kmp_engine *e, int i)
{
    kempe_assembly *a = NULL;
    kmp_runner *run = NULL;
    kmp_ensemble_result *result = &e->results[i];
    result->steps = result->rejected = result->refused = result->rhs = result->exchanges = 0;
    result->parts = 0;
    kempe_status status = kmp_instance_assemble(e, i, &a);
    if (status == KEMPE_E_INPUT)
        return KEMPE_OK;
    if (status == KEMPE_OK)
        status = kmp_runner_new(e->s, &e->spec, a, &run);
    kmp_instance_begin_account(e, i);
    while (run && status == KEMPE_OK && kmp_runner_t(run) < e->spec.t_end)
        status = make_step(e, i, run);
    status = run ? finish(e, i, run, status) : fail_alone(e, i, status);
    kmp_runner_free(run);
    kempe_assembly_free(a);
    if (status == KEMPE_OK)
        kmp_context_clear(e->context);
    return status;
}

/* -- a part ------------------------------------------------------------------------------------------ */

/* The position of a run in a part. */
typedef struct part_state {
    double *row, work;   /* row: 3 n + m */
    kmp_partition found; /* at the last look, if the instance may return */
    double margin;       /* the last pivot of J over its usual size at the last look; -1: none yet */
} part_state;

/* True if lanes can take the instance back at the end of the last step: the usual formulation runs, the user's own
 * coordinates are good, and the closures recede from a change point. Sets the row and the partition there. */
static kempe_status look(kmp_engine *e, int i, kmp_runner *run, int rank, part_state *part, bool *returns)
{
    kmp_instance *x = &e->instances[i];
    double t = kmp_runner_t(run), before = part->margin;
    *returns = false;
    if (run->near_singular || run->walks || run->at_event || kmp_friction_is_smooth(run->friction) ||
        kmp_runner_sample_is_due(run, t))
        return KEMPE_OK;
    rank = e->s->switches ? run->margin.r : rank;
    KMP_TRY(kmp_runner_row(run, t, part->row, &part->work));
    if (!kmp_instance_has_angles(e, part->row, KMP_AXES_RESUMED))
        return KEMPE_OK;
    if (e->conditions)
        kmp_eval_set_modes(e->eval, kmp_runner_modes(run));
    kmp_eval_closure(e->eval, t, part->row);
    kmp_partition_free(&part->found);
    KMP_TRY(kmp_partition_of_rank(&part->found, e->s, e->eval->jacobian, rank, NULL, 0));
    double last = rank > 0 ? part->found.pivots[rank - 1] : 1;
    x->usual = fmax(x->usual, last);
    part->margin = last / x->usual;
    *returns = before >= 0 && part->margin >= before && part->margin > KMP_NEAR_SINGULAR_LEFT;
    return KEMPE_OK;
}

/* Steps until lanes can take the instance back, or to the end. */
static kempe_status advance(kmp_engine *e, int i, kmp_runner *run, int rank, part_state *part, bool *returns)
{
    kempe_status status = KEMPE_OK;
    *returns = false;
    for (int steps = 1; status == KEMPE_OK && !*returns && kmp_runner_t(run) < e->spec.t_end; steps++) {
        status = make_step(e, i, run);
        if (status == KEMPE_OK && steps >= PART_STEPS && steps % PART_LOOKS == 0 && kmp_runner_t(run) < e->spec.t_end)
            status = look(e, i, run, rank, part, returns);
    }
    return status;
}

/* Puts the instance into a pool where the part has ended. */
static kempe_status come_back(kmp_engine *e, int i, kmp_runner *run, part_state *part)
{
    kmp_instance *x = &e->instances[i];
    kmp_run_report report;
    kmp_runner_count(run, &report);
    add_work(&e->results[i], &report);
    e->results[i].parts++;
    x->t = kmp_runner_t(run);
    x->h = kmp_runner_step_size(run);
    x->has_step = x->h > 0;
    x->tries = 0;
    x->seen_t = x->corrected.t = -1;
    x->pace = 0;
    if (e->conditions) {
        memcpy(x->mode, kmp_runner_modes(run), (size_t)e->s->events.count * sizeof *x->mode);
        memcpy(x->past, run->crossing->past, (size_t)e->s->events.count * sizeof *x->past);
    }
    if (e->eval->nu)
        memcpy(x->nu, part->row + 3 * e->n, (size_t)e->m * sizeof *x->nu);
    if (e->site) {
        kmp_runner_keep_memory(run, x->memory);
        x->next_sample = kmp_runner_next_sample(run);
        x->stood = true;
    }
    kmp_present_inputs_copy(&x->inputs, kmp_runner_inputs(run));
    if (e->s->dissipative)
        x->y[e->n + part->found.p] = part->work;
    return kmp_instance_go_on(e, i, KEMPE_OK, &part->found, part->row, part->row + e->n);
}

/* The run of a part, from (q, qd) in part->row; `margin` 0: the run finds the usual size of the margin. */
static kempe_status begin(kmp_engine *e, int i, double margin, kmp_run_spec *spec, const part_state *part,
                          kmp_runner **run)
{
    kmp_instance *x = &e->instances[i];
    kempe_assembly *a = kmp_assembly_new(e->s);
    KMP_TRY(kmp_made(e->context, a));
    memcpy(a->q, part->row, (size_t)e->n * sizeof *a->q);
    memcpy(a->qd, part->row + e->n, (size_t)e->n * sizeof *a->qd);
    a->closed = true;
    *spec = e->spec;
    spec->t_start = x->t;
    spec->work_start = part->work;
    spec->rate_scale = x->rate_scale;
    spec->first_step = x->has_step ? x->h : 0;
    spec->inputs_start = &x->inputs;
    spec->u_count = margin > 0 ? 0 : e->spec.u_count;
    spec->mode_start = e->conditions ? x->mode : NULL;
    spec->memory_start = x->stood ? x->memory : NULL;
    kempe_status status = kmp_runner_new(e->s, spec, a, run);
    kempe_assembly_free(a);
    if (status == KEMPE_OK && margin > 0) /* as in the steps before */
        (*run)->margin.usual = fmax((*run)->margin.usual, (*run)->margin.last / margin);
    else if (status == KEMPE_OK && (*run)->margin.last > 0)
        x->usual *= (*run)->margin.usual / (*run)->margin.last;
    if (status == KEMPE_OK)
        x->rate_scale = kmp_runner_rate_scale(*run);
    if (status == KEMPE_OK && e->conditions)
        memcpy((*run)->crossing->past, x->past, (size_t)e->s->events.count * sizeof *x->past);
    return status;
}

/* The run of a part and what comes after it. */
static kempe_status run_part(kmp_engine *e, int i, int rank, double margin, part_state *part, const char *why)
{
    kmp_run_spec spec;
    kmp_runner *run = NULL;
    bool returns = false;
    e->results[i].why = why;
    kempe_status status = begin(e, i, margin, &spec, part, &run);
    if (status == KEMPE_OK)
        status = advance(e, i, run, rank, part, &returns);
    if (status == KEMPE_OK && returns) {
        status = come_back(e, i, run, part);
    } else if (status == KEMPE_OK || (status == KEMPE_STOPPED && run && kmp_runner_ended(run))) {
        e->results[i].parts++;
        status = finish(e, i, run, status);
        kmp_engine_count(e);
    } else if (status == KEMPE_E_FAILED || status == KEMPE_STOPPED) { /* a run from the start says why */
        kmp_instance_leave(e, i, why);
        status = KEMPE_OK;
    }
    kmp_runner_free(run);
    if (status == KEMPE_OK)
        kmp_context_clear(e->context);
    return status;
}

kempe_status kmp_instance_start_apart(kmp_engine *e, int i, int rank, double margin, const double *q, const double *qd,
                                      double work, const char *why)
{
    part_state part = {.margin = -1, .work = work, .row = KMP_NEW(double, 3 * e->n + e->m)};
    KMP_TRY(kmp_made(e->context, part.row));
    memcpy(part.row, q, (size_t)e->n * sizeof *q);
    memcpy(part.row + e->n, qd, (size_t)e->n * sizeof *qd);
    kempe_status status = run_part(e, i, rank, margin, &part, why);
    kmp_partition_free(&part.found);
    kmp_free(part.row);
    return status;
}

kempe_status kmp_instance_apart(kmp_engine *e, kmp_lane_group *from, int i, double margin, const char *why)
{
    if (!kmp_instance_unpack(e, from, i, true))
        return KEMPE_OK;
    KMP_TRY(kmp_instance_take_values(e, i));
    kmp_eval_renew_parameters(e->eval);
    return kmp_instance_start_apart(e, i, from->part.r, margin, e->state, e->state + e->n,
                                    e->s->dissipative ? e->instances[i].y[e->n + from->part.p] : 0, why);
}
