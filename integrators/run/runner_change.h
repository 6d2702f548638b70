/* SPDX-License-Identifier: BSD-3-Clause */
/* Changes between steps: events, change points, other rows or unknowns, a second chance for a stopped integrator. */
#pragma once

#include "integrators/run/run.h"

double kmp_runner_step_size(const kmp_runner *runner);

/** Handles the end of the last step at t: passes an event, changes the formulation or the unknowns. */
kempe_status kmp_runner_change(kmp_runner *run, double t);

/** Takes the inputs from t within the last step on, and restarts the integrator there, a one-step method with its
 * present step size. */
kempe_status kmp_runner_begin_anew(kmp_runner *run, double t);

/** Recovers from a step that failed: an implicit integrator restarts from a consistent state. The reduced formulation,
 * if the user did not choose it, is replaced by the projected one. */
kempe_status kmp_runner_rescue(kmp_runner *run, double t);

/** Passes what happens at t, at the closed state in run->room.state: the `event` that the crossing has looked at,
 * samples, states that change at events, jumps of inputs, and the impacts and modes that follow. *work: of impacts, J.
 */
kempe_status kmp_runner_pass_here(kmp_runner *run, double t, bool event, double *work);

/** Continues with another formulation from a state in the present charts (q, qd, qdd in run->room.state) with a first
 * step. */
kempe_status kmp_runner_restart(kmp_runner *run, double t, bool near_singular, double work, double first_step);

/** Sets a limit that no further step goes beyond, not before the end of the last step. */
void kmp_runner_stop_at(kmp_runner *runner, double stop);

/** From here on the steps up to t are bounded by their progress, in addition to the bound of the run; 0: no longer. */
void kmp_runner_bound_until(kmp_runner *runner, double t);

/** The inputs of the run: a caller may give one (kmp_present_inputs_give). It acts from the next step on, or from a
 * following kmp_runner_cut on. */
kmp_present_inputs *kmp_runner_inputs(kmp_runner *runner);

/** The data that a run needs, in addition to a row, to continue from it: the conditions (a value for each), the scale
 * of rates in the tolerances, the next step of a one-step method (0: another method), the method that replaces it. */
const double *kmp_runner_modes(const kmp_runner *runner);

double kmp_runner_rate_scale(const kmp_runner *runner);

/** Passes an event at t, the end of the last step, as the next step would; *passed: there was one. */
kempe_status kmp_runner_pass(kmp_runner *runner, double t, bool *passed);

kmp_stand_in kmp_runner_stand_in(const kmp_runner *runner);
