/* SPDX-License-Identifier: BSD-3-Clause */
/* Newton's method for the stages with a Jacobian of each, in one system of all stages. */
#pragma once

#include "integrators/steppers/collocation.h"

bool kmp_collocation_allocate_coupled(kmp_collocation *s);
kmp_collocation_outcome kmp_collocation_prepare_coupled(kmp_collocation *s, double h);
void kmp_collocation_correct_coupled(kmp_collocation *s);
