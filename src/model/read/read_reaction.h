/* SPDX-License-Identifier: BSD-3-Clause */
/* Friction by the reaction that presses its surfaces together. The reaction of a closure is the vector of its
 * multipliers. */
#pragma once

#include "model/read/reading.h"

/** Adds locked translations to joints of the tree whose friction depends on their reaction: after the bodies; their
 * number; their locks, after the other closures. */
void kmp_read_pressed(kmp_reader *r);
int kmp_count_pressed(const kempe_model *model);
void kmp_lock_pressed(kmp_reader *r);

/** The size of the reaction that presses on a friction: of the closure that it names, or of its joint. NULL after an
 * error. */
const kmp_expr *kmp_read_reaction(kmp_reader *r, const kmp_force *force, const kmp_yaml *map, const char *what);
