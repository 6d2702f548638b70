/* SPDX-License-Identifier: BSD-3-Clause */
/* The integrator of a run. If the user chose none, the reduced formulation begins with the one of less counted time
 * (cost_model.h), and later tries the other: the one with more time simulated in a counted cycle continues. */
#pragma once

#include "integrators/run/run.h"
#include "integrators/run/runner.h"
#include "integrators/steppers/solver.h"

/** Makes the integrator for the present formulation and state; the first one is chosen by counted work. */
kempe_status kmp_runner_make_integrator(kmp_runner *run);

/** True for a mechanism with no degree of freedom: it is followed along its closures, there are no unknowns of
 * motion. */
bool kmp_runner_is_followed(const kmp_runner *run);

/** The integrator for which a formulation is made. */
const kmp_solver_kind *kmp_runner_integrator(const kmp_runner *run);

/** The integrator of the first steps with a formulation, which needs nothing that a few steps do not pay. */
const kmp_solver_kind *kmp_runner_begins_with(const kmp_runner *run);

/** The rest of the run from t on, in units of the time of its motion. */
double kmp_runner_length(const kmp_runner *run, double t);

/** Between steps, at t: tries another integrator where the user chose none. */
kempe_status kmp_runner_try_integrator(kmp_runner *run, double t);

/** Notes whether the present formulation, which the run leaves, lasted long enough for programs and lanes. */
void kmp_runner_end_formulation(kmp_runner *run);
void kmp_runner_release_integrators(kmp_runner *run);

/** True if its integrators are the ones that the run uses now, or one that is tried for comparison. */
bool kmp_runner_suits(const kmp_runner *run, const kmp_visit *visit);

/** Takes the integrators of a visit whose formulation continues at t. */
kempe_status kmp_runner_return_to_integrator(kmp_runner *run, double t, const kmp_visit *visit);

/** True if the formulation is about to change its unknowns at t, and the projected one, which needs no choice of them,
 * is to continue: programs of stages must be written again in any case, and those serve to the end of the run. The user
 * chose no formulation. Asked before kmp_runner_restart, which makes it so. */
bool kmp_runner_leaves_unknowns(kmp_runner *run, double t);

/** True if it has done so, and many stages cannot be evaluated in lanes there: the run is to continue as before, and
 * leaves its unknowns no more. Asked before kmp_runner_restart, which makes it so. */
bool kmp_runner_takes_unknowns_again(kmp_runner *run);

/** Before the formulation may change its unknowns, and after it did: the first says whether they have lasted long
 * enough for lanes; the second, before the start at t with a step *h, takes an integrator without lanes where it has
 * made none. */
void kmp_runner_end_unknowns(kmp_runner *run);
kempe_status kmp_runner_begin_unknowns(kmp_runner *run, double t, double *h);
