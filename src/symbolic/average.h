/* SPDX-License-Identifier: BSD-3-Clause */
/* Room to compute a block of averages in (implicit.h): one for each thread. */
#ifndef KMP_SYMBOLIC_AVERAGE_H
#define KMP_SYMBOLIC_AVERAGE_H

#include "symbolic/program.h"

typedef struct kmp_average kmp_average;

/** The block must outlive it. NULL: no memory. */
kmp_average *kmp_average_room(const kmp_block *block);
void kmp_average_room_free(kmp_average *average);

/** The components for these arguments. No allocation. */
void kmp_average_run(kmp_average *average, const double *arguments);
/** As they were last computed. */
const double *kmp_average_values(const kmp_average *average);

#endif
