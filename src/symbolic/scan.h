/* SPDX-License-Identifier: BSD-3-Clause */
/* The merit of all candidates of a block at once: each instruction on all of them, and what depends on the candidates
 * alone computed when it is made. The bits are those of one candidate after another. */
#ifndef KMP_SYMBOLIC_SCAN_H
#define KMP_SYMBOLIC_SCAN_H

#include "symbolic/program.h"

typedef struct kmp_scan kmp_scan;

/** Of a block with candidates, which must outlive it. NULL: no memory. */
kmp_scan *kmp_scan_new(const kmp_block *block);
void kmp_scan_free(kmp_scan *scan);

/** The merits for the block's arguments. No allocation. */
const double *kmp_scan_run(kmp_scan *scan, const double *arguments);

#endif
