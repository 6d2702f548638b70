/* SPDX-License-Identifier: BSD-3-Clause */
/* Multistep methods under inputs that jump. */
#pragma once

#include "integrators/run/run.h"

kmp_stand_in kmp_runner_stand_in(const kmp_runner *runner);

/** At a restart for inputs: true if another integrator shall continue, for which the formulation is made anew. */
bool kmp_runner_relieve(kmp_runner *run, double t);

/** Between steps, at t: returns to the multistep method after enough steps without a restart. */
kempe_status kmp_runner_return(kmp_runner *run, double t);
