/* SPDX-License-Identifier: BSD-3-Clause */
/* The merit of all candidates of a block at once: each instruction on all of them, and what depends on the candidates
 * alone computed when it is made. The bits are those of one candidate after another. */
#ifndef KMP_SYMBOLIC_SCAN_H
#define KMP_SYMBOLIC_SCAN_H

#include "symbolic/program.h"
#include <stddef.h>

typedef struct kmp_scan kmp_scan;

/** Of a block, at candidates, which must outlive it both. NULL: no memory. */
kmp_scan *kmp_scan_new(const kmp_block *block, int candidates, const double *candidate);
void kmp_scan_free(kmp_scan *scan);

/** Puts the arguments; runs a stage (1, 2) of the block's program in these groups of eight, which begin at candidate
 * first[0] and so on, or in all; then `kmp_scan_output(scan, stage, k)` times its sign is output k of the stage at each
 * of them, in a row that is filled up to a multiple of eight with the first candidate. No allocation. */
void kmp_scan_set(kmp_scan *scan, const double *arguments);
void kmp_scan_groups(kmp_scan *scan, int stage, size_t count, const size_t *first);
void kmp_scan_every(kmp_scan *scan, int stage);
const double *kmp_scan_output(const kmp_scan *scan, int stage, int k, double *sign);

/** The merits for the block's arguments. No allocation. */
const double *kmp_scan_run(kmp_scan *scan, const double *arguments);

#endif
