/* SPDX-License-Identifier: BSD-3-Clause */
/* A force along the line between two points, by an expression of any quantities. With d from the first point to the
 * second and the tension T, the force on the first point is T d / |d|; its power is -T times the rate of |d|. */
#pragma once

#include "dynamics/forces/forces.h"

/** A tension along the line d from the first of two points to the second, whose length is given: law of an expression.
 * A constant one has a potential, any other counts its power. */
void kmp_pull_along(kmp_forces *forces, const kmp_tree *tree, const kmp_force *force, kmp_ref tension, bool constant,
                    unsigned energy);
