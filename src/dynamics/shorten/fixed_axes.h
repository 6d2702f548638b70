/* SPDX-License-Identifier: BSD-3-Clause */
/* Non-rotating axes: link axes that do not turn with the joint. Vectors need not be rotated forth and back, but all
 * vectors fixed to the body are, by the joint's angle. If the parent's axes do not turn about the same axis either, the
 * angle is the sum. */
#ifndef KMP_DYNAMICS_SHORTEN_FIXED_AXES_H
#define KMP_DYNAMICS_SHORTEN_FIXED_AXES_H

#include "dynamics/kinematics/kinematics.h"

/** Sets `stay` of each motion, of rotations alone; the tree's axes must all turn with their links. */
void kmp_let_stay(kmp_tree *tree, const uint8_t *stay);

#endif
