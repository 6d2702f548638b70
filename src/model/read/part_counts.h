/* SPDX-License-Identifier: BSD-3-Clause */
/* Numbers of parameters that decide which parts a model has: `when` of an entry, `repeat` of an include. They are
 * needed before the parameters are read. */
#pragma once

#include "model/read/reading.h"

/** The number of copies that `repeat` of an include requests, 0 or more; -1 after an error. */
int kmp_read_repeat(kmp_reader *r, const kmp_yaml *node);

/** False where `when` of an include or an entry is 0, or after an error. */
bool kmp_is_present(kmp_reader *r, const kmp_yaml *when);

/** The entries of a section whose `when` is not 0, without that key. */
const kmp_yaml *kmp_present_entries(kmp_reader *r, const char *section, const kmp_yaml *map);

/** Fixes the parameters of these numbers, once parameters are read: no study may vary them. */
void kmp_fix_part_counts(kmp_reader *r);
