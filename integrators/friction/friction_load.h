/* SPDX-License-Identifier: BSD-3-Clause */
/* The part of their static levels with which friction elements keep a mechanism at rest: the least s for which
 * forces |f| <= s F exist with a + D f = 0. If the forces are unique, they give s. */
#pragma once

#include "integrators/friction/friction_site.h"

/** Divides the load of the elements that do not slip in x->f so that the largest part of a static level is least; if
 * possible without elements whose level depends on multipliers, and may fall at any time. */
KMP_LOCAL void kmp_friction_share(kmp_friction_run *x);

/** At rest: *part of the static levels that friction needs to keep all elements at rest, INFINITY if it cannot; forces
 * in x->f, static levels in x->upper, by element. */
KMP_LOCAL int kmp_friction_load(kmp_friction_run *x, double t, const double *q, const double *qd, double *part);
