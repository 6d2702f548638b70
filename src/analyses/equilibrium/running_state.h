/* SPDX-License-Identifier: BSD-3-Clause */
/* Steady motions that need no names. A coordinate is cyclic if no force, closure or mass changes with it, so that
 * only its rate counts (Pars, A Treatise on Analytical Dynamics, 1965, ch. 10). */
#pragma once

#include "analyses/equilibrium/equilibrium_study.h"
#include "model/data/force.h"

/** Searches the steady motion that a start with the rates qd (n) leads to (running_state.c), if nothing depends on
 * coordinates that move there, and no other quantity is requested. Otherwise it searches an equilibrium at rest, and a
 * steady motion if there is none. Rates at which R = 0 are then in search->rates, and the rates that no force
 * determines. Errors as kmp_equilibrium_find. */
kempe_status kmp_equilibrium_or_steady(kmp_linear *linear, double t, double *q, const double *qd, kmp_search *search);
