/* SPDX-License-Identifier: BSD-3-Clause */
/* Loop closures and drives. */
#pragma once

#include "model/data/closure.h"
#include "model/read/reading.h"

void kmp_read_closures(kmp_reader *r); /* drives too */

/** A closure without points and coordinate, for which there is room; the row of a force that has modes. */
kmp_closure *kmp_add_closure(kmp_reader *r, const char *name, kmp_closure_kind kind, kmp_place place);
void kmp_add_row(kmp_reader *r, kmp_force *force, kmp_closure_kind kind, bool turns);
