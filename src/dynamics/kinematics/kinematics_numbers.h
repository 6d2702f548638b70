/* SPDX-License-Identifier: BSD-3-Clause */
/* Numbers and expressions of the model as nodes of the graph. */
#pragma once

#include "dynamics/kinematics/link_tree.h"

/** The number of symbols, and the values of all. */
int kmp_tree_symbol_count(const kmp_tree *tree);
void kmp_tree_symbol_values(const kmp_tree *tree, double *value);

/** A number of the model as a node: a constant, or its expression over parameters. */
kmp_ref kmp_tree_number(const kmp_tree *tree, const kmp_number *number);

/** An angle about an axis as a sum of coordinates (model/data/angle_sum.h), `at_rest` with the angle where all of them
 * are zero; false: it is none. At the cost of the way between its bodies. */
bool kmp_tree_angle_sum(const kmp_tree *tree, const kmp_measure_argument axis[3], bool at_rest, kmp_ref *sum);
kmp_vec kmp_tree_vector(const kmp_tree *tree, const kmp_number number[3]);

/** An expression of the model language over q, qd, t and parameters as a node. */
kmp_ref kmp_tree_expression(const kmp_tree *tree, const kmp_expr *expr);

/** An expression in a row of a closure: its kinks are conditions, as rates may jump there. */
kmp_ref kmp_tree_bent(const kmp_tree *tree, const kmp_expr *expr);

/** The multiplier of a closure's declared row, an input KMP_IN_LAMBDA; zero for one that is not kept, and before the
 *  closures' rows are derived. */
kmp_ref kmp_tree_multiplier(const kmp_tree *tree, int closure, int component);

/** The declared row of number k, from 0, among the rows that a closure keeps: lambda.CLOSURE.k+1; -1: there is none. */
int kmp_tree_kept(const kmp_tree *tree, int closure, int k);

/** Position, velocity or angular velocity of a point: from the origin of the ground, in its axes; `from` >= 0: from
 * that point, relative to its body, in its axes. */
kmp_vec kmp_point_measure(const kmp_tree *tree, kmp_measure_kind kind, int point, int from);

/** The rate of the distance of two points. */
kmp_ref kmp_point_approach(const kmp_tree *tree, int a, int b);
