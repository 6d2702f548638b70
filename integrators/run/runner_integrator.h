/* SPDX-License-Identifier: BSD-3-Clause */
/* The integrator of a run. If the user chose none, the reduced formulation begins with the one of less counted time
 * (cost_model.h), and later tries the other: that with more time simulated in a counted cycle continues. */
#pragma once

#include "integrators/run/run.h"
#include "integrators/steppers/solver.h"

/** Makes the integrator for the present formulation and state; the first one is chosen by counted work. */
kempe_status kmp_runner_make_integrator(kmp_runner *run);

/** True for a mechanism with no degree of freedom: it is followed along its closures, there are no unknowns of
 * motion. */
bool kmp_runner_is_followed(const kmp_runner *run);

/** The integrator for which a formulation is made. */
const kmp_solver_kind *kmp_runner_integrator(const kmp_runner *run);

/** True if the formulation is made with lanes for it; one that may last for a few steps only makes none, and another
 * integrator takes them. */
bool kmp_runner_makes_lanes(const kmp_runner *run);

/** Between steps, at t: tries another integrator where the user chose none. */
kempe_status kmp_runner_try_integrator(kmp_runner *run, double t);

/** Frees the integrators of the present formulation. */
void kmp_runner_release_integrators(kmp_runner *run);
