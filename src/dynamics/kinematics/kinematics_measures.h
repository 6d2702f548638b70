/* SPDX-License-Identifier: BSD-3-Clause */
/* Positions, velocities, distances and angles of points and axes: the measures of expressions (model/expressions/
 * measures.def), and rates of expressions. */
#pragma once

#include "dynamics/kinematics/link_tree.h"

/** Position, velocity or angular velocity of a point: from the origin of the ground, in its axes; `from` >= 0: from
 * that point, relative to its body, in its axes. */
kmp_vec kmp_point_measure(const kmp_tree *tree, kmp_measure_kind kind, int point, int from);

/** The rate of the distance of two points. */
kmp_ref kmp_point_approach(const kmp_tree *tree, int a, int b);

/** A measure of expressions, component `number` of it. */
kmp_ref kmp_tree_measure(const kmp_tree *tree, const kmp_measure *measure, int number);

/** The total time derivative of an expression of t and q. */
kmp_ref kmp_tree_rate(const kmp_tree *tree, const kmp_expr *of);
