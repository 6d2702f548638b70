/* SPDX-License-Identifier: BSD-3-Clause */
/* Axes that stay behind where the joint turns: vectors need not be turned there and back, but all that is fixed to the
 * body is, by the joint's angle; with those of a parent that stays about the same axis, by the sum. */
#ifndef KMP_DYNAMICS_SHORTEN_FIXED_AXES_H
#define KMP_DYNAMICS_SHORTEN_FIXED_AXES_H

#include "dynamics/kinematics/kinematics.h"

/** `stay` of each motion, of rotations alone; in a tree whose axes all turn with their links. */
void kmp_let_stay(kmp_tree *tree, const bool *stay);

#endif
