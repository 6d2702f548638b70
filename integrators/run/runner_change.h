/* SPDX-License-Identifier: BSD-3-Clause */
/* Changes between steps: events, change points, other rows or unknowns, a second chance for a stopped integrator. */
#pragma once

#include "integrators/run/run.h"

double kmp_runner_step_size(const kmp_runner *runner);

/** Continues at t with a new formulation for the present integrator, from the state that the old one completes, with
 * `first_step`. */
kempe_status kmp_runner_change_formulation(kmp_runner *run, double t, bool near_singular, double first_step);

/** Handles the end of the last step at t: passes an event, changes the formulation or the unknowns. */
kempe_status kmp_runner_change(kmp_runner *run, double t);

/** Takes the inputs from t within the last step on, and restarts the integrator there, a one-step method with its
 * present step size. */
kempe_status kmp_runner_begin_anew(kmp_runner *run, double t);

/** Recovers from a step that failed: an implicit integrator restarts from a consistent state. The reduced formulation,
 * if the user did not choose it, is replaced by the projected one. */
kempe_status kmp_runner_rescue(kmp_runner *run, double t);

/** Ends the run at t with the sentence of a condition: KEMPE_STOPPED. */
kempe_status kmp_runner_end(kmp_runner *run, double t, int condition);

/** Passes what happens at t, at the closed state in run->state: the `event` that the crossing has looked at, samples,
 * states that change at events, jumps of inputs, and the impacts and modes that follow. *work: of impacts, J. */
kempe_status kmp_runner_pass_here(kmp_runner *run, double t, bool event, double *work);

/** Continues with another formulation from a state in the present charts (q, qd, qdd in run->state) with a first
 * step. */
kempe_status kmp_runner_restart(kmp_runner *run, double t, bool near_singular, double work, double first_step);
