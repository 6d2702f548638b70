/* SPDX-License-Identifier: BSD-3-Clause */
/* Ranges of named quantities as users write them: "crank=0.28:0.32", "A=-30 deg:30 deg:61", "k=2 kN/m". */
#ifndef KMP_MODEL_RANGES_H
#define KMP_MODEL_RANGES_H

#include "base/context.h"

typedef struct kmp_range {
    char *name;
    double from, to; /* in SI; the same where one value stands */
    int count;       /* how many values, ends included; 1 where one stands, 0: not said */
} kmp_range;

typedef struct kmp_ranges {
    int count;
    kmp_range *range;
} kmp_ranges;

/** Reads NAME=A, NAME=A:B or NAME=A:B:N, with commas between several; a number may have a sign and a unit. Names are
 * not looked up. KEMPE_E_ARGUMENT: what is written otherwise. */
kempe_status kmp_ranges_read(kempe_context *context, const char *text, kmp_ranges *ranges);
void kmp_ranges_free(kmp_ranges *ranges);

/** Value k of `count` evenly from one end to the other. */
double kmp_range_value(const kmp_range *range, int k, int count);

#endif
