/* SPDX-License-Identifier: BSD-3-Clause */
/* Contacts whose gap counts from the start as it is written: of ropes without a length, of teeth with play. */
#pragma once

#include "base/text.h"
#include "dynamics/system.h"

/** Appends a sentence, with its line end, for each contact whose gap there differs between the start as it is written
 * and the closed one, q: its preload, its slack or its play is not what the model says of the start. False: no memory.
 */
bool kmp_put_start_gaps(kmp_text *text, const kempe_system *system, const double *q);
