/* SPDX-License-Identifier: BSD-3-Clause */
/* The decision on modes at a state: the box-constrained problem of the elements at rest, with levels that may depend
 * on its solution; where these do not settle, all combinations of modes. */
#pragma once

#include "integrators/friction/friction_site.h"

/** Rounding of the acceleration of element i of the elements at rest. */
KMP_LOCAL double kmp_friction_rounding(const kmp_friction_run *x, int i);

/** At rest: *part of the static levels that friction needs to keep all elements at rest, INFINITY if it cannot; forces
 * in x->f, static levels in x->upper, by element. */
KMP_LOCAL int kmp_friction_load(kmp_friction_run *x, double t, const double *q, const double *qd, double *part);

/** Decides on modes at t and the state (q, qd); rates are made consistent with the rows that are held, and the site is
 * evaluated there. */
KMP_LOCAL int kmp_friction_settle_modes(kmp_friction_run *x, double t, double *q, double *qd);

/** True if contacts share loads with friction, of which it is not reported that the motion depends on how. */
KMP_LOCAL bool kmp_friction_may_share(const kmp_friction_run *x);

/** Between decisions, with the modes as they are and the values of all conditions at (t, q, qd): reports contacts that
 * share loads so that the motion depends on how. Modes of elements and inputs of the site are changed. */
KMP_LOCAL int kmp_friction_examine(kmp_friction_run *x, double t, const double *q, const double *qd);
