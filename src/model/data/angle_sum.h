/* SPDX-License-Identifier: BSD-3-Clause */
/* Angles that are sums of coordinates. */
#pragma once

#include "model/data/touch.h"
#include "model/language/expression.h"
#include <kempe/kempe.h>
#include <stdbool.h>

/** The angle from the first axis to the second about the third, where all rotations between their bodies are about the
 * third axis: `constant` + sum factor[k] q[k] with factors 1, -1 and 0 (one for each coordinate, initially zero), which
 * counts turns. False: a rotation about another axis is between them. */
bool kmp_angle_sum(const kempe_model *model, const kmp_measure_argument axis[3], double *constant, double *factor);

/** True if the body of a point moves relative to the body of an axis only in planes across this axis: all rotations
 * between them are about it, no translation is along it. */
bool kmp_moves_across(const kempe_model *model, int point, const kmp_measure_argument *axis);

/** True if a direction stays across an axis, in these planes. */
bool kmp_stays_across(const kempe_model *model, const kmp_measure_argument *direction,
                      const kmp_measure_argument *axis);

/** The axis of the second side's point across which the first side's body moves, so that its slip has only one
 * direction; -1: there is none, and it has two. */
int kmp_touch_plane(const kempe_model *model, const kmp_contact_pair *touch);
