/* SPDX-License-Identifier: BSD-3-Clause */
/* Values at the start of the model: of lengths and paths that count from there. */
#pragma once

#include "dynamics/kinematics/link_tree.h"

/** True if a drive has the coordinate of a motion. */
bool kmp_is_driven(const kempe_model *model, int motion);

/** Puts the coordinates of the start, as they are driven or written, in place of all coordinates, and the values of the
 * time and of inputs at the start. The values are functions of a tree without charts, whose conditions are evaluated in
 * place: during a run the conditions of a drive change, and its start does not. `of`: the tree of the equations, which
 * gets the values of the symbols. */
void kmp_put_start(const kmp_tree *tree, const kmp_tree *of, int count, kmp_ref *values);
