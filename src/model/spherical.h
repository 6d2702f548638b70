/* SPDX-License-Identifier: BSD-3-Clause */
/* Joints whose rotations may be counted from another orientation: three rotations about axes each perpendicular to the
 * next. No force, closure or expression uses their coordinates, so that the angles appear in the results alone. */
#ifndef KMP_MODEL_SPHERICAL_H
#define KMP_MODEL_SPHERICAL_H

#include "model/model.h"

/** first[i]: the first of the three rotations of joint i, ascending; room for a third of the motions. The number of
 *  them, -1 when there is no memory. */
int kmp_spherical_find(const kempe_model *model, int *first);

#endif
