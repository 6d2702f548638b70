/* SPDX-License-Identifier: BSD-3-Clause */
/* A block's program at many places at once: each instruction at all of them; values that depend only on the places are
 * computed when the scan is made. The bits are the same as of one place after another. */
#pragma once

#include "symbolic/program.h"
#include <stddef.h>

typedef struct kmp_scan kmp_scan;

enum { KMP_SCAN_GROUP = 8 }; /* places that are run together */

/** Values times `sign`. The value of a place is at `row + (place & by_place) + (slot & by_slot)`, and the values of its
 * group of eight follow the first one's. The masks have all bits or none: by place are the values that depend only on
 * the place, by slot the values that depend on arguments too, and values only of arguments are eight equal ones. */
typedef struct kmp_scan_row {
    const double *row;
    size_t by_place, by_slot;
    double sign;
} kmp_scan_row;

static inline const double *kmp_scan_at(const kmp_scan_row *row, size_t place, size_t slot)
{
    return row->row + (place & row->by_place) + (slot & row->by_slot);
}

/** A scan of a block at places: values of unknown 0, padded to a multiple of eight with the first. With
 * machine code, where there is some, or interpreted, with the same bits. NULL: no memory. */
kmp_scan *kmp_scan_new(const kmp_program_block *block, int places, const double *place, bool native);
void kmp_scan_free(void *scan);

/** kmp_scan_set: sets the arguments. The others run a stage (1, 2) of the block's program in these groups of eight, and
 * read output k of the stage there. Groups begin at place first[0] and so on; what depends on arguments is kept in
 * slots, as many places as groups need, from `slot` on: few, and near each other in memory. The stage before must have
 * run in the same groups and slots. No allocation. */
void kmp_scan_set(kmp_scan *scan, const double *arguments);
void kmp_scan_groups(kmp_scan *scan, int stage, size_t count, const size_t *first, size_t slot);
kmp_scan_row kmp_scan_output(const kmp_scan *scan, int stage, int k);

/** Operations since the scan was made, of all arguments and places, including the ones that fill groups of eight. */
kmp_counts kmp_scan_count(const void *scan);

/** A scan of a block at its candidates, and the merits there for its arguments; padded to a multiple of eight. No
 * allocation in the second one. */
void *kmp_scan_of_candidates(const kmp_program_block *block, bool native);
const double *kmp_scan_run(void *scan, const double *arguments);
