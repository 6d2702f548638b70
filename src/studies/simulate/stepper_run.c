/* SPDX-License-Identifier: BSD-3-Clause */
/* The public stepper: a runner, and its current row. */
#include "base/memory.h"
#include "integrators/steppers/sample_times.h"
#include "output/print.h"
#include "studies/simulate/stepper_inside.h"
#include <math.h>
#include <string.h>

double kmp_stepper_here(const kempe_stepper *s)
{
    double end = kmp_runner_t(s->runner);
    return kmp_same_time(s->t, end) ? end : s->t;
}

/* Takes the row at t, within the last step or at its end up to rounding; after a failure the old one is unchanged. */
static kempe_status stepper_stand_at(kempe_stepper *s, double t)
{
    double *row = s->next;
    KMP_TRY(kmp_runner_row(s->runner, fmin(t, kmp_runner_t(s->runner)), row, &s->work));
    s->next = s->row;
    s->row = row;
    s->t = t;
    return KEMPE_OK;
}

/* Keeps the sentence of a failure, and gives it to the context too; forgets an earlier one. */
static kempe_status stepper_settle(kempe_stepper *s, kempe_status status)
{
    kmp_run_report report;
    if (status == KEMPE_E_ARGUMENT)
        return status;
    kmp_free(s->reason);
    s->reason = NULL;
    s->status = status;
    s->doubted = s->doubted || kmp_context_verdict(s->system->context, KEMPE_OK) != KEMPE_OK;
    if (status == KEMPE_OK)
        return status;
    kmp_runner_report(s->runner, &report);
    s->reason = report.reason;
    if (status == KEMPE_E_FAILED && s->reason && !strstr(kempe_context_message(s->system->context), s->reason))
        return kmp_fail(s->system->context, status, "%s", s->reason);
    return status;
}

kempe_status kmp_stepper_run_from(kempe_stepper *s, const kmp_run_spec *spec, const kempe_assembly *start)
{
    kmp_runner *before = s->runner, *runner = NULL;
    kempe_status status = kmp_runner_new(s->system, spec, start, &runner);
    if (!runner)
        return status;
    s->runner = runner;
    if (status == KEMPE_OK)
        status = stepper_stand_at(s, spec->t_start);
    if (status != KEMPE_OK && before) {
        (void)stepper_settle(s, status);
        s->runner = before;
        kmp_runner_free(runner);
        return status;
    }
    kmp_runner_free(before);
    if (before)
        status = stepper_settle(s, status);
    s->stop = s->spec.t_end;
    s->own_stop = INFINITY;
    s->given = false;
    return status;
}

static kempe_status begin(kempe_stepper *s)
{
    KMP_TRY(kmp_made(s->system->context,
                     KMP_ARENA_EACH(&s->arena, double, 3 * s->system->n + s->system->m, &s->row, &s->next)));
    kempe_status status = kmp_stepper_run_from(s, &s->spec, NULL);
    return s->runner ? stepper_settle(s, status) : status;
}

kempe_status kempe_stepper_new(const kempe_system *system, const kempe_run_options *run, kempe_stepper **stepper)
{
    KMP_WANTED_BOTH(system, stepper);
    KMP_OPTIONS(system->context, kempe_run_options, run);
    kmp_model_begin_forces(system->model);
    KMP_MAKE(system->context, kempe_stepper, s);
    s->system = system;
    kempe_status status = kmp_spec_of(system, run, &s->arena, &s->spec);
    s->spec.max_steps = s->spec.max_steps ? s->spec.max_steps : -1; /* monitored by the caller; t_end is far */
    if (status == KEMPE_OK)
        status = begin(s);
    return KMP_GIVE_OR_FREE(status, stepper, s, kempe_stepper_free);
}

void kempe_stepper_free(kempe_stepper *stepper)
{
    if (!stepper)
        return;
    kempe_workspace_free(stepper->closer);
    kmp_runner_free(stepper->runner);
    kmp_stepper_parameters_free(stepper->parameters);
    kmp_arena_free(&stepper->arena);
    kmp_free(stepper->reason);
    kmp_free(stepper);
}

void kempe_stepper_keep_inputs(kempe_stepper *stepper, int keep)
{
    if (stepper)
        stepper->keeps = keep;
}

/* Inputs may have changed since the last call: they apply from here on. While they may change, no step goes beyond
 * `until`. */
static kempe_status follow_inputs(kempe_stepper *s, double until)
{
    bool forced = s->system->force && !s->keeps, given = s->given, cut;
    double here = kmp_stepper_here(s), own_stop = kmp_last_equal(here) < s->own_stop ? s->own_stop : INFINITY;
    double stop = fmin(forced || s->samples ? until : s->spec.t_end, own_stop);
    if (!forced && !given && stop == s->stop)
        return KEMPE_OK;
    cut = forced || s->system->force || kmp_runner_t(s->runner) > (given ? here : stop);
    s->stop = stop;
    s->given = false;
    if (cut)
        return kmp_runner_cut(s->runner, here, stop);
    kmp_runner_stop_at(s->runner, stop);
    return KEMPE_OK;
}

kempe_status kmp_stepper_stand_with_inputs(kempe_stepper *s)
{
    if (!s->given)
        return KEMPE_OK;
    s->given = false;
    KMP_TRY(kmp_runner_cut(s->runner, kmp_stepper_here(s), s->stop));
    return stepper_stand_at(s, s->t);
}

kempe_status kmp_stepper_enter(kempe_stepper *s)
{
    if (s->steps)
        return kmp_fail(s->system->context, KEMPE_E_ARGUMENT,
                        "the stepper is inside a step: its force function cannot move it");
    kmp_model_begin(s->system->model);
    return KEMPE_OK;
}

static kempe_status step(kempe_stepper *s)
{
    kempe_status status = KEMPE_OK;
    if (kmp_last_equal(s->t) >= s->spec.t_end)
        return kmp_fail(s->system->context, KEMPE_E_ARGUMENT, "the run ends at t_end = %g s", s->spec.t_end);
    status = follow_inputs(s, s->spec.t_end);
    if (status == KEMPE_OK && kmp_last_equal(s->t) >= kmp_runner_t(s->runner))
        status = kmp_runner_step(s->runner);
    kempe_status stood =
        status == KEMPE_OK || status == KEMPE_STOPPED ? stepper_stand_at(s, kmp_runner_t(s->runner)) : status;
    return stepper_settle(s, stood == KEMPE_OK ? status : stood);
}

kempe_status kempe_stepper_step(kempe_stepper *s)
{
    KMP_WANTED(NULL, s, "stepper");
    KMP_TRY(kmp_stepper_enter(s));
    s->steps = true;
    kempe_status status = step(s);
    s->steps = false;
    return status;
}

static kempe_status advance(kempe_stepper *s, double t)
{
    kempe_status status = KEMPE_OK;
    if (!(t >= s->t) || t > kmp_last_equal(s->spec.t_end))
        return kmp_fail(s->system->context, KEMPE_E_ARGUMENT,
                        "t = %.9g s is not between here (%.9g s) and t_end = %g s", t, s->t, s->spec.t_end);
    if (t > s->t)
        status = follow_inputs(s, t);
    while (status == KEMPE_OK && kmp_last_equal(kmp_runner_t(s->runner)) < t)
        status = kmp_runner_step(s->runner);
    kempe_status stood = status == KEMPE_OK            ? stepper_stand_at(s, t)
                         : kmp_runner_ended(s->runner) ? stepper_stand_at(s, kmp_runner_t(s->runner))
                                                       : status;
    return stepper_settle(s, status == KEMPE_OK || stood != KEMPE_OK ? stood : status);
}

kempe_status kempe_stepper_advance(kempe_stepper *s, double t)
{
    KMP_WANTED(NULL, s, "stepper");
    KMP_TRY(kmp_stepper_enter(s));
    s->steps = true;
    kempe_status status = advance(s, t);
    s->steps = false;
    return status;
}

KMP_GETTER(double kempe_stepper_time(const kempe_stepper *stepper), stepper, stepper->t, NAN)

#define PART_OF_ROW(name, at)                                                                                          \
    KMP_GETTER(const double *kempe_stepper_##name(const kempe_stepper *stepper), stepper,                              \
               stepper->row + (at)*stepper->system->n, NULL)

PART_OF_ROW(q, 0)
PART_OF_ROW(qd, 1)
PART_OF_ROW(qdd, 2)
PART_OF_ROW(lambda, 3)

kempe_work kempe_stepper_work(const kempe_stepper *stepper)
{
    KMP_GIVEN(stepper, (kempe_work){0});
    kmp_run_report r;
    kmp_runner_count(stepper->runner, &r);
    return (kempe_work){.steps = r.steps,
                        .rejected = r.rejected,
                        .refused = r.refused,
                        .rhs = r.rhs,
                        .newton = r.newton,
                        .factorizations = r.factorizations,
                        .exchanges = r.exchanges,
                        .centrings = r.centrings};
}

KMP_GETTER(const char *kempe_stepper_status(const kempe_stepper *stepper), stepper,
           kmp_checked_word(stepper->status == KEMPE_OK && stepper->doubted ? KEMPE_UNTRUSTED : stepper->status, false),
           "")
KMP_GETTER(const char *kempe_stepper_reason(const kempe_stepper *stepper), stepper,
           stepper->reason ? stepper->reason : "", "")
