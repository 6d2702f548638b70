/* SPDX-License-Identifier: BSD-3-Clause */
/* A model as a robot in URDF, with the loops of URDF+ (docs/urdf.md). The ground is the root, a link without mass. */
#pragma once

#include "exchange/formats/written_tree.h"

/** A writer of writers.def. */
void kmp_urdf_write(kmp_export *w);
