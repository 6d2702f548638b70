/* SPDX-License-Identifier: BSD-3-Clause */
/* A block's program at many places at once: each instruction at all of them, and what depends on the places alone
 * computed when it is made. The bits are those of one place after another. */
#ifndef KMP_SYMBOLIC_SUMS_SCAN_H
#define KMP_SYMBOLIC_SUMS_SCAN_H

#include "symbolic/program/program.h"
#include <stddef.h>

typedef struct kmp_scan kmp_scan;

enum { KMP_SCAN_GROUP = 8 }; /* places that are run together */

/** Values at all places, times `sign`: that of place k is at `row + moves k`, and those of its group of eight
 * follow the first one's; `moves` is 0 where they are the same at all places. */
typedef struct kmp_scan_row {
    const double *row;
    size_t moves;
    double sign;
} kmp_scan_row;

static inline const double *kmp_scan_at(const kmp_scan_row *row, size_t place)
{
    return row->row + row->moves * place;
}

/** Of a block, at places: values of unknown 0, filled up to a multiple of eight with the first. NULL: no memory. */
kmp_scan *kmp_scan_new(const kmp_program_block *block, int places, const double *place);
void kmp_scan_free(kmp_scan *scan);

/** Puts the arguments; runs a stage (1, 2) of the block's program in these groups of eight, which begin at place
 * first[0] and so on, and in which the stage before it was run; output k of the stage there. No allocation. */
void kmp_scan_set(kmp_scan *scan, const double *arguments);
void kmp_scan_groups(kmp_scan *scan, int stage, size_t count, const size_t *first);
kmp_scan_row kmp_scan_output(const kmp_scan *scan, int stage, int k);

/** The block's merits at its candidates, which are the places, for its arguments; filled up likewise. No allocation. */
const double *kmp_scan_run(kmp_scan *scan, const double *arguments);

#endif
