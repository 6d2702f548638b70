/* SPDX-License-Identifier: BSD-3-Clause */
#pragma once

#include "backend/layout.h"

/** Writes into layout->part, by instruction of the stage: 0 before, 1 .. parts, parts + 1 after. Returns the number of
 * parts; 0: division does not pay, all entries are 0; -1: no memory. */
int kmp_parts_find(kmp_layout *layout, int stage, int threads);
