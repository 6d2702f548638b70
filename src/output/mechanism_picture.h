/* SPDX-License-Identifier: BSD-3-Clause */
/* A still picture of a mechanism: the hulls of its bodies, joints, springs and guides, seen from one side. */
#pragma once

#include "base/text.h"
#include "model/data/model.h"

/** A square picture of `size` pixels at the user's coordinates q. False: no memory. */
bool kmp_mechanism_picture(kmp_text *svg, const kempe_model *model, const double *q, double size);
