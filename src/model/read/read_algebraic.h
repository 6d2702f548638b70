/* SPDX-License-Identifier: BSD-3-Clause */
/* Algebraic variables, and expressions under a name. Each may use those before it. */
#pragma once

#include "model/read/reading.h"

/** The expression of a name. */
void kmp_reader_take_named(kmp_reader *r, kmp_place place, const char *what, const kmp_expr *value, kmp_unknowns *u);
void kmp_read_unknowns(kmp_reader *r); /* but for values that depend on multipliers */
void kmp_read_late_unknowns(kmp_reader *r);
