/* SPDX-License-Identifier: BSD-3-Clause */
/* Three rotations of one joint are singular where the second turns the third axis into the plane of the first two:
 * their angles are then no coordinates of the orientation, and M is singular. */
#ifndef KMP_CONSTRAINTS_CLOSING_ANGLES_H
#define KMP_CONSTRAINTS_CLOSING_ANGLES_H

#include "base/text.h"
#include "model/model.h"

/** Appends a clause that names a joint with three rotations that are singular at q, or nearly, if there is one. */
void kmp_angles_explain(const kempe_model *model, const double *q, kmp_text *text);

#endif
