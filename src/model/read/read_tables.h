/* SPDX-License-Identifier: BSD-3-Clause */
/* Tables: functions of one variable by points, in the file or in columns of a CSV file in its folder, and of two
 * variables by a grid of points. */
#pragma once

#include "model/read/reading.h"

/** A table of the model by its name; NULL after an error. */
const kmp_named_table *kmp_read_table_name(kmp_reader *r, const kmp_yaml *node, const char *what);

void kmp_read_tables(kmp_reader *r);
/** True if expressions use a name already: a function, a parameter, a symbol. */
bool kmp_name_means_something(const kmp_reader *r, const char *name);
