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

/** Reads the points; members up to `dimension` are set by the caller. False after an error. */
bool kmp_read_points(kmp_points *p);

/** Reports places that do not increase, which have the name `places` in a sentence; `one`: the name of a row. */
bool kmp_points_increase(const kmp_points *points, const char *places, const char *one);

/** Reads `unit`, of the columns of a CSV file: of this dimension, which an error calls so. Without it: SI. False after
 * an error. */
bool kmp_read_column_unit(const kmp_points *p, kmp_dimension dimension, const char *so, kmp_unit *unit);

/** The path of a file that another one names, in the folder of that one. */
const char *kmp_path_beside(kmp_reader *r, int file, const char *name);

/** Reads a file for the reader, to be freed; NULL after an error: "WHAT: reason". */
char *kmp_read_file(kmp_reader *r, kmp_file_kind kind, const kmp_yaml *node, const char *what, const char *path,
                    size_t *length);
