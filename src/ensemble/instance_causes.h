/* SPDX-License-Identifier: BSD-3-Clause */
/* Why instances did not reach their end: their reasons; reasons that differ only in numbers are one cause. */
#pragma once

#include "base/arena.h"
#include "base/text.h"
#include <kempe/ensemble.h>

typedef struct kmp_instance_cause {
    kempe_outcome outcome;
    const char *reason, *values; /* of the first instance: its sentence, and the values that it has, "crank = 1.71" */
    long count, first;           /* number of that instance, from 0 on */
} kmp_instance_cause;

enum { KMP_CAUSES_MOST = 16 };

/** Begins as zero; to be freed. */
typedef struct kmp_instance_causes {
    kmp_arena arena; /* of the sentences; failed without memory */
    int count;
    kmp_instance_cause cause[KMP_CAUSES_MOST];
    long others; /* instances with further causes */
} kmp_instance_causes;

/** Adds the rows of a table "instances" that have a reason; its first row is instance number `first`, from 0 on. */
void kmp_instance_causes_add(kmp_instance_causes *causes, const kempe_table *instances, long first);

/** Appends a line for each cause. */
void kmp_instance_causes_put(kmp_text *text, const kmp_instance_causes *causes);
void kmp_instance_causes_free(kmp_instance_causes *causes);
