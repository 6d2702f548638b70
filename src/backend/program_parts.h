/* SPDX-License-Identifier: BSD-3-Clause */
/* Parts of a stage that do not read each other: the sub-systems of a vehicle, as far as its equations fall apart.
 *
 * Implicit blocks are the seeds: those that share most of what they are computed from go together. What feeds several
 * parts comes before all of them, what reads several comes after. The instructions are the same, and so are the bits.
 */
#ifndef KMP_BACKEND_PROGRAM_PARTS_H
#define KMP_BACKEND_PROGRAM_PARTS_H

#include "backend/layout.h"

enum { KMP_PARTS_MOST = 64 };

/** Writes into layout->part, by instruction of the stage: 0 before, 1 .. parts, parts + 1 after. Number of parts; 0:
 *  the stage is not worth it, all its instructions are 0; -1: no memory. */
int kmp_parts_find(kmp_layout *layout, int stage, int threads);

#endif
