/* SPDX-License-Identifier: BSD-3-Clause */
/* The coordinates of joints that are cut, as functions of those of the tree. */
#pragma once

#include "model/data/model.h"

/** Coordinate k of a joint between two points by its chain of motions (model/data/joints.def), whose axes a, b and c
 * are the columns of m in the axes of either point: a rotation in (-pi, pi], where it is not a sum of coordinates. As
 * the expression `q(name)`; NULL: no memory. */
const kmp_expr *kmp_cut_coordinate_of(kmp_arena *arena, const char *name, const char *chain, int k, double m[3][3],
                                      const kmp_measure_argument end[2]);

/** The number of a coordinate by its name, or by JOINT.k, in model->cut_coordinates; -1: there is none. */
int kmp_cut_coordinate_find(const kempe_model *model, const char *name);
