/* SPDX-License-Identifier: BSD-3-Clause */
/* The rows of closure_numbers.def. */
#pragma once

#include "model/data/force_table.h"

typedef struct kmp_closure_number {
    const char *kind, *key, *unit;
    kmp_field_rule rule;
    const char *hint;
} kmp_closure_number;

/** Returns the row of a kind of closure; NULL if that kind takes no numbers. */
const kmp_closure_number *kmp_closure_number_of(const char *kind);

/** A closure's number if that is a positive length, which is characteristic of the mechanism; NULL: it has none. */
const kmp_number *kmp_closure_length(const kmp_closure *closure);
