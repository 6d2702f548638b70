/* SPDX-License-Identifier: BSD-3-Clause */
/* Inputs of the model during a run. Each step has one polynomial for each input: it ends at the next sample. */
#pragma once

#include "integrators/run/run.h"

/** Sets a limit that no further step goes beyond, not before the end of the last step. */
void kmp_runner_stop_at(kmp_runner *runner, double stop);

/** The inputs of the run: a caller may give one (kmp_present_inputs_give). It acts from the next step on, or from a
 * following kmp_runner_cut on. */
kmp_present_inputs *kmp_runner_inputs(kmp_runner *runner);

/** The data that a run needs, beside a row, to continue from it: the conditions (a value for each), the scale of rates
 * in the tolerances, the next step of a one-step method (0: another method), the method that stands in. */
const double *kmp_runner_modes(const kmp_runner *runner);

/** Completes the past of delayed signals up to t within the last step. */
kempe_status kmp_runner_recall(kmp_runner *runner, double t);

double kmp_runner_rate_scale(const kmp_runner *runner);

/** Passes an event at t, the end of the last step, as the next step would; *passed: there was one. */
kempe_status kmp_runner_pass(kmp_runner *runner, double t, bool *passed);

/** Goes on beyond a sample of an input where the last step has ended at it: restarts the integrator where the value
 * jumps. */
kempe_status kmp_runner_pass_samples(kmp_runner *run, double t);

/** Takes the inputs from t on, after the row at t within the last step has been made. */
kempe_status kmp_runner_take_inputs(kmp_runner *run, double t);

/** Changes the conditions that the inputs from t on have changed, at the state in run->state; ends the run where one of
 * them says so. */
kempe_status kmp_runner_take_conditions(kmp_runner *run, double t);
