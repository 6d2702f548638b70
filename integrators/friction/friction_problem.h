/* SPDX-License-Identifier: BSD-3-Clause */
/* The decision on modes at a state: the box-constrained problem of the elements at rest, with levels that may depend
 * on its solution; where these do not settle, all combinations of modes. */
#pragma once

#include "integrators/friction/friction_site.h"

/** Decides which elements at rest slip (`broken`, `sense`); x->f has the forces of the others. `rate`: of the motion,
 * 1/s. */
KMP_LOCAL int kmp_friction_decide(kmp_friction_run *x, double t, const double *q, const double *qd, double rate);

/** Sets up the problem of the elements at rest: x->which, a, d, and the levels in x->upper. */
KMP_LOCAL int kmp_friction_pose(kmp_friction_run *x, double t, const double *q, const double *qd, double rate);

/** Rounding of the acceleration of element i of those at rest. */
KMP_LOCAL double kmp_friction_rounding(const kmp_friction_run *x, int i);

/** Largest change of a force from the last pass, x->tried, over the largest force. */
KMP_LOCAL double kmp_friction_changed(const kmp_friction_run *x);
