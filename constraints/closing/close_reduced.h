/* SPDX-License-Identifier: BSD-3-Clause */
/* Newton closing of the dependent coordinates, with the factors of a reduction. */
#pragma once

#include "constraints/partition/reduction.h"

/** Closes v of q for its u by Newton's method from the given v, with a new Jacobian in each iteration. Ends when a
 * correction is within `fraction` of the weights w (n; NULL: to round-off). The evaluator's closure and the factors are
 * then those of q to that accuracy. 0; 1 when corrections no longer contract or Jv is singular. */
int kmp_reduction_close(kmp_reduction *red, double t, double *q, const double *w, double fraction);
