/* SPDX-License-Identifier: BSD-3-Clause */
/* Three rotations of one joint are singular where the second one turns the third axis into the plane of the first two:
 * their angles are then no coordinates of the orientation, and M has no inverse. */
#ifndef KMP_CONSTRAINTS_ANGLES_H
#define KMP_CONSTRAINTS_ANGLES_H

#include "base/text.h"
#include "model/model.h"

/** The middle one of three rotations of a joint that are singular at q, or nearly; -1 when there is none. */
int kmp_angles_singular(const kempe_model *model, const double *q);

/** Appends a clause that names the joint, when there is one. */
void kmp_angles_explain(const kempe_model *model, const double *q, kmp_text *text);

#endif
