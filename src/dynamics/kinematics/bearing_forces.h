/* SPDX-License-Identifier: BSD-3-Clause */
/* The forces of two bearings on one pin, by the load of its joint. */
#pragma once

#include "dynamics/kinematics/link_tree.h"
#include "model/data/bearing_pair.h"

/** KMP_BEARING_VALUES of a pair by the force and the moment of its joint on the second body, about its point, in ground
 * axes. */
void kmp_bearing_forces(const kmp_tree *tree, const kmp_bearing_pair *pair, kmp_vec force, kmp_vec moment,
                        kmp_ref values[KMP_BEARING_VALUES]);

/** The same by the load that tree->reactions have of the joint; zero where they have none. */
void kmp_bearing_reactions(const kmp_tree *tree, const kmp_bearing_pair *pair, kmp_ref values[KMP_BEARING_VALUES]);
