/* SPDX-License-Identifier: BSD-3-Clause */
/* Joints that must have a coordinate, or multipliers, because the machine and its start use them. Outputs, sensors
 * and `until` change no tree. */
#pragma once

#include "model/read/reading.h"

/** Sets need, asked and start of the edges from their uses elsewhere in the model. */
void kmp_linkage_find_uses(kmp_reader *r, kmp_linkage *g);

/** Words of expressions whose argument is a closure with its multipliers; NULL ends the list. */
extern const char *const kmp_words_of_loads[];
