/* SPDX-License-Identifier: BSD-3-Clause */
/* Formulations that a run has left and may return to: of friction that sticks and slips in turn, of contacts that open
 * and close. They keep their programs, lanes and integrators. */
#pragma once

#include "integrators/run/run.h"

/** Leaves the present formulation. It rests if other conditions are `held` now and it can; else it is released. */
void kmp_runner_leave(kmp_runner *run, bool held);

/** Continues at t, the closed state in run->room.state, with the formulation that rests for the present rows,
 * coordinates, method and integrator; *returned: there is one. The integrator is to be started with run->room.y. */
kempe_status kmp_runner_return(kmp_runner *run, double t, bool *returned);

/** Releases all that rest. */
void kmp_runner_forget_visits(kmp_runner *run);
