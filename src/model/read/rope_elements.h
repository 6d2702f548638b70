/* SPDX-License-Identifier: BSD-3-Clause */
/* The elements of ropes. */
#pragma once

#include "model/read/reading.h"

/** Adds to r->root what holds each rope taut, an entry of `loops` or `contacts` of its name, and the friction on a
 * sheave, an entry of `forces` NAME_friction. */
void kmp_read_rope_elements(kmp_reader *r);
