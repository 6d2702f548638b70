/* SPDX-License-Identifier: BSD-3-Clause */
/* A block's program at many places at once: each instruction at all of them; values that depend on the places alone are
 * computed when the scan is made. The bits are those of one place after another. */
#pragma once

#include "symbolic/program/program.h"
#include <stddef.h>

typedef struct kmp_scan kmp_scan;

enum { KMP_SCAN_GROUP = 8 }; /* places that are run together */

/** Values at all places, times `sign`. The value of place k is at `row + moves k`, and those of its group of eight
 * follow the first one's. `moves` is 0 where they are equal at all places. */
typedef struct kmp_scan_row {
    const double *row;
    size_t moves;
    double sign;
} kmp_scan_row;

static inline const double *kmp_scan_at(const kmp_scan_row *row, size_t place)
{
    return row->row + row->moves * place;
}

/** A scan of a block at places: values of unknown 0, padded to a multiple of eight with the first. NULL: no memory. */
kmp_scan *kmp_scan_new(const kmp_program_block *block, int places, const double *place);
void kmp_scan_free(kmp_scan *scan);

/** kmp_scan_set: sets the arguments. The others run a stage (1, 2) of the block's program in these groups of eight, and
 * read output k of the stage there. Groups begin at place first[0] and so on. The stage before must have run in them.
 * No allocation. */
void kmp_scan_set(kmp_scan *scan, const double *arguments);
void kmp_scan_groups(kmp_scan *scan, int stage, size_t count, const size_t *first);
kmp_scan_row kmp_scan_output(const kmp_scan *scan, int stage, int k);

/** Operations since the scan was made, of all arguments and places, those that fill groups of eight included. */
kmp_counts kmp_scan_count(const kmp_scan *scan);

/** The block's merits at its candidates, which are the places, for its arguments; padded to a multiple of eight. No
 * allocation. */
const double *kmp_scan_run(kmp_scan *scan, const double *arguments);
