/* SPDX-License-Identifier: BSD-3-Clause */
/* Parts of a stage that do not read each other: the sub-systems of a vehicle, as far as its equations fall apart.
 *
 * Implicit blocks are the seeds: blocks that share most of their inputs' computation go together. Values that several
 * parts read come before all of them, values that read several parts come after. The instructions and their bits are
 * unchanged.
 */
#ifndef KMP_BACKEND_PROGRAM_PARTS_H
#define KMP_BACKEND_PROGRAM_PARTS_H

#include "backend/layout.h"

enum { KMP_PARTS_MOST = 64 };

/** Writes into layout->part, by instruction of the stage: 0 before, 1 .. parts, parts + 1 after. Returns the number of
 * parts; 0: division does not pay, all entries are 0; -1: no memory. */
int kmp_parts_find(kmp_layout *layout, int stage, int threads);

#endif
