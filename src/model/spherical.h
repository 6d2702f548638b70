/* SPDX-License-Identifier: BSD-3-Clause */
/* Which joints may have their rotations counted from another orientation: those of three rotations about axes each
 * across the next, whose coordinates stand in no force, closure or expression, so that nobody but the user's own eyes
 * asks what the angles are. */
#ifndef KMP_MODEL_SPHERICAL_H
#define KMP_MODEL_SPHERICAL_H

#include "model/model.h"

/** first[i]: the first of the three rotations of joint i, ascending; room for a third of the motions. The number of
 *  them, -1 when there is no memory. */
int kmp_spherical_find(const kempe_model *model, int *first);

#endif
