/* SPDX-License-Identifier: BSD-3-Clause */
/* A model in SDFormat (docs/sdf.md): a joint is given in the frame of its parent, its child in the frame of the
 * joint. Loops are joints of the graph whose frames on both links coincide where all coordinates are zero, or
 * constraints of Drake between two points. */
#pragma once

#include "exchange/formats/written_tree.h"

/** A writer of writers.def. */
void kmp_sdf_write(kmp_export *w);
