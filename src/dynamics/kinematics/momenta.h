/* SPDX-License-Identifier: BSD-3-Clause */
/* Linear and angular momentum of a body, and of all bodies, in ground axes. */
#pragma once

#include "dynamics/kinematics/link_tree.h"

/** sum m v of a body, of all bodies for -1. */
kmp_vec kmp_momentum(const kmp_tree *tree, int body);

/** sum x × m v + I w of a body, of all bodies for -1, with x from a point of the model, or for -1 from their common
 * centre of mass; velocities are relative to the ground in both cases. */
kmp_vec kmp_angular_momentum(const kmp_tree *tree, int body, int point);
