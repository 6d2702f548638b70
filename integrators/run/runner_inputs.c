/* SPDX-License-Identifier: BSD-3-Clause */
/* Inputs of the model during a run. Each step has one polynomial for each input: it ends at the next sample. Beyond it
 * the integrator restarts where a value jumps, and continues in its order elsewhere. */
#include "integrators/run/runner_inputs.h"
#include "integrators/run/delays.h"
#include "integrators/run/runner.h"
#include "integrators/run/runner_change.h"
#include "integrators/run/sampler.h"
#include "model/data/model.h"
#include "model/read/loads.h"

/* An input of a closure must have no jump in value and rate, which no force can follow. */
static kempe_status check_closures(const kmp_runner *run, double t)
{
    const kmp_present_inputs *inputs = &run->eval->inputs;
    const kempe_model *model = run->s->model;
    for (int k = 0; k < inputs->count; k++) {
        const kmp_signal_piece *piece = &inputs->piece[k];
        bool jumps =
            kmp_same_time(piece->from, t) && piece->jump < 2 && !inputs->replaced[k]; /* callers' are checked before */
        const kmp_closure *closure = jumps ? kmp_model_moved_by(model, k) : NULL;
        if (closure)
            return kmp_fail(run->s->context, KEMPE_E_FAILED,
                            "%s:%d:%d: closure '%s' depends on input '%s', whose %s jumps at t = %.9g s: let its "
                            "samples be cubic and extend beyond the end of the run",
                            model->files[closure->place.file], closure->place.line, closure->place.column,
                            closure->name, model->inputs[k].name, piece->jump ? "rate" : "value", t);
    }
    return KEMPE_OK;
}

kempe_status kmp_runner_take_inputs(kmp_runner *run, double t)
{
    int input;
    if (run->eval->inputs.count == 0 || kmp_present_inputs_enter(&run->eval->inputs, t, &input) >= 2)
        return KEMPE_OK;
    return check_closures(run, t);
}

kempe_status kmp_runner_take_conditions(kmp_runner *run, double t)
{
    const double *q = run->state, *qd = q + run->s->n;
    bool changed;
    if (!run->crossing || (run->eval->inputs.count == 0 && !run->sampler))
        return KEMPE_OK;
    KMP_TRY(kmp_event_tracker_change(run->crossing, t, q, qd, false, &changed));
    run->crossing->end = kmp_event_tracker_first_end(run->crossing);
    return run->crossing->end >= 0 ? kmp_runner_end(run, t, run->crossing->end) : KEMPE_OK;
}

kempe_status kmp_runner_pass_samples(kmp_runner *run, double t)
{
    kmp_present_inputs *inputs = &run->eval->inputs;
    int input, jump;
    if (kmp_present_inputs_are_due(inputs, t)) {
        jump = kmp_present_inputs_enter(inputs, t, &input);
        if (jump < 2)
            KMP_TRY(check_closures(run, t));
        run->anew = run->anew || jump == 0 || (jump == 1 && run->spec.slopes && run->delays);
        kmp_delays_follow(run, t);
    }
    if (kmp_runner_sample_is_due(run, t)) {
        run->anew = true;
        kmp_delays_jump(run, 0);
    }
    double limit = kmp_runner_limit(run, t);
    if (run->anew || run->solver->t_end == limit)
        return KEMPE_OK;
    if (run->kind->extend)
        return run->kind->extend(run->solver, limit);
    run->solver->t_end = limit;
    return KEMPE_OK;
}

void kmp_runner_stop_at(kmp_runner *run, double stop)
{
    run->stop = stop;
}

kmp_present_inputs *kmp_runner_inputs(kmp_runner *run)
{
    return &run->eval->inputs;
}

const double *kmp_runner_modes(const kmp_runner *run)
{
    return run->eval->mode;
}

kempe_status kmp_runner_recall(kmp_runner *run, double t)
{
    return kmp_delays_record(run, t);
}

double kmp_runner_rate_scale(const kmp_runner *run)
{
    return run->rate_scale;
}

kempe_status kmp_runner_pass(kmp_runner *run, double t, bool *passed)
{
    *passed = run->at_event && t == run->event_t;
    return *passed ? kmp_runner_change(run, t) : KEMPE_OK;
}
