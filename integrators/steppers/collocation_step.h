/* SPDX-License-Identifier: BSD-3-Clause */
/* The stages of a step. Picard's iteration evaluates f at all stages and takes the result: it needs no matrix, and
 * contracts with the step size times the rate of the fastest forces. */
#pragma once

#include "integrators/steppers/collocation.h"

/** Evaluates f of s->stage at s->at in `count` lanes at least. */
int kmp_collocation_evaluate(kmp_collocation *s, int count);

/** Derivatives of the stages of a step h, in g, and the error's estimate with its weighted size. KMP_..._BAD_ITERATION:
 * *shorter is the part of h to try next. */
kmp_collocation_outcome kmp_collocation_find_stages(kmp_collocation *s, double h, double *error, double *shorter);

/** y at the end of that step, without the formulation's correction, into y_old. */
void kmp_collocation_end(kmp_collocation *s, double h);
