/* SPDX-License-Identifier: BSD-3-Clause */
/* Derivatives of the rates behind an impact. */
#pragma once

#include "analyses/sensitivity/forward_inside.h"

/** Converts the derivatives of the rates in the place, along an event, from those before it to those after it, qd (n).
 * KMP_HALT: there are none, with the reason. */
int kmp_forward_strike(kmp_forward_formulation *f, const kmp_formulation_start *start);
