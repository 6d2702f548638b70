/* SPDX-License-Identifier: BSD-3-Clause */
/* Axes and orientations: unit vectors, and frames from one or two of them. */
#pragma once

#include "model/read/reading.h"

/** A unit vector: x, -y, ..., or a list of three numbers. */
bool kmp_read_axis(kmp_reader *r, const kmp_yaml *node, const char *what, double axis[3]);

/** An orientation {x: axis, z: axis}: the first axis is used as given, the second is orthogonalised. From a single axis
 * the others follow (kmp_complete_axes). The columns of m are the three axes. */
bool kmp_read_axes(kmp_reader *r, const kmp_yaml *node, const char *what, double m[3][3]);

/** Right-handed axes whose k-th is `axis`, by the shortest rotation from unit vector k. For the axis opposite to k it
 * is half a turn about the one that follows k. */
void kmp_complete_axes(int k, const double axis[3], double m[3][3]);

/** Right-handed axes whose k-th is `first` and whose l-th is in the plane with `second`; false when the two are
 * parallel. */
bool kmp_square_axes(int k, const double first[3], int l, const double second[3], double m[3][3]);
