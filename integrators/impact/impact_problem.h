/* SPDX-License-Identifier: BSD-3-Clause */
/* The decision on impulses at an impact: the contacts that take part, with bounds of friction. */
#pragma once

#include "integrators/impact/impact_inside.h"

/** The element of number k of the ones that take part. */
KMP_LOCAL kmp_friction_element *kmp_impact_element(const kmp_impact_run *p, int k);

/** Changes rates at t where open contacts strike, and parts surfaces that overlap by rounding, with only the rows
 * of the closures. *gain: change of the kinetic energy, J. */
KMP_LOCAL int kmp_impact_decide(kmp_impact_run *p, double t, double *q, double *qd, double *gain);

/** The first contact whose surfaces overlap at (t, q, qd) by more than rounding; -1: none. */
KMP_LOCAL int kmp_impact_overlap(kmp_impact_run *p, double t, const double *q, const double *qd);
