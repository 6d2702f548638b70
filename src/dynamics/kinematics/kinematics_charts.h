/* SPDX-License-Identifier: BSD-3-Clause */
/* Positions of the charts of spherical joints in the chain of links. */
#pragma once

#include "dynamics/kinematics/link_tree.h"

/** The position of a spherical joint's chart: true for before its three rotations, false for after them, by the
 * estimated cost. After them it rotates the data of the body once and each vector passed to carried bodies. Before them
 * it rotates each vector that passes the joint, where the base itself turns or a point's position is needed. */
bool kmp_tree_chart_before(const kempe_model *model, int first);

/** Sets `before` and `after` of all links, none with a chart unless the tree is charted. false: no memory. */
bool kmp_tree_place_charts(kmp_tree *tree);
