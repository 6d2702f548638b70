/* SPDX-License-Identifier: BSD-3-Clause */
/* The largest eigenvalue of the equations at a state, by powers of differences (Sommeijer, Shampine, Verwer, J. Comput.
 * Appl. Math. 88 (1998) 315): it limits the steps of explicit methods. */
#pragma once

#include "integrators/steppers/ode.h"
#include <stdbool.h>

/** About the size of the largest eigenvalue, 1/s; 0: it is not known. `atol`: of each unknown, by which they are
 * compared; `part`: of it are the differences. Eight evaluations. */
double kmp_fastest_rate(const kmp_ode *ode, double t, const double *y, const double *atol, double part);
