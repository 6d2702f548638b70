/* SPDX-License-Identifier: BSD-3-Clause */
/* Redundant everywhere or singular only here: compares the rank at random configurations, found by moving along
 * random tangents. */
#pragma once

#include "constraints/diagnosis/diagnosis.h"

/* Parts of the examination, in order. The arena records memory failures. */
void kmp_diagnosis_points(kmp_examination *x);
void kmp_diagnosis_dependents(kmp_examination *x);
void kmp_diagnosis_second_order(kmp_examination *x);
void kmp_diagnosis_repairs(kmp_examination *x);

/** Jacobian k of the examination: 0 here, 1 .. point_count at the random configurations. */
const double *kmp_diagnosis_jacobian(const kmp_examination *x, int k);
