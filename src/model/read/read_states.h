/* SPDX-License-Identifier: BSD-3-Clause */
/* States and function blocks: their names and motions before any expression is read that may contain them; the laws
 * of states after all that those may contain, the value of a block that is an expression where it is first used. */
#pragma once

#include "model/read/reading.h"

void kmp_read_states(kmp_reader *r); /* but for their rates, which are the last forces */
void kmp_add_state_rates(kmp_reader *r);

/** Adds a state of an element, which begins at zero and whose rate its law adds. */
void kmp_reader_add_state(kmp_reader *r, const char *name, kmp_place place);

/** Reads the block whose value is variable `unknown` of the model, if it is one and has not been read. One that is
 * being read depends on itself, which is an error. */
void kmp_read_block_of(kmp_reader *r, int unknown);
