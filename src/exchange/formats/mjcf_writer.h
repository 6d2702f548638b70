/* SPDX-License-Identifier: BSD-3-Clause */
/* A model in MJCF, the format of MuJoCo. A body has all motions of its chain as joints. */
#pragma once

#include "exchange/formats/written_tree.h"

/** A writer of writers.def. */
void kmp_mjcf_write(kmp_export *w);
