/* SPDX-License-Identifier: BSD-3-Clause */
/* Joints whose rotations may be counted from another orientation: three rotations about axes each perpendicular to
 * the next. No force, closure or expression uses their coordinates, so that the angles appear only in the results. */
#pragma once

#include <kempe/kempe.h>

/** Joints whose rotations may be counted from another orientation (spherical.c). first[i]: the first of the three
 * rotations of joint i, ascending; room for a third of the motions. The number of them, -1 when there is no memory. */
int kmp_spherical_find(const kempe_model *model, int *first);
