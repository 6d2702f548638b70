/* SPDX-License-Identifier: BSD-3-Clause */
/* Anderson's mixing of the corrections of Newton's method. */
#pragma once

#include "integrators/steppers/collocation.h"

/** Takes a correction s->change of g in a sweep, and combines it with those before where they fall slowly. Returns the
 * larger weighted square of the correction and of the combination. */
double kmp_collocation_mix(kmp_collocation *s, bool first);

/** The weighted square of x (inner x w). */
double kmp_collocation_square(const kmp_collocation *s, const double *x);
