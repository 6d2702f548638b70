/* SPDX-License-Identifier: BSD-3-Clause */
/* Tables as Apache Parquet files: for pandas, Polars, DuckDB, Spark. Equal tables give equal bytes. */
#pragma once

#include "base/text.h"
#include <kempe/table.h>

/** An entry of the key-value metadata. */
typedef struct kmp_parquet_note {
    const char *key, *value;
} kmp_parquet_note;

/** Appends the file of a table to an empty text. Columns are required doubles, unknown numbers NaN, or UTF-8 words. The
 * key-value metadata are the units, "unit.NAME" for each column that has one, then the notes, and with notes a sum of
 * all bytes before it. */
void kmp_parquet_put(kmp_text *text, const kempe_table *table, int note_count, const kmp_parquet_note *notes);

/** The sum of `size` bytes at the beginning of a file, and its key. */
enum { KMP_PARQUET_SUM = 16 };
extern const char kmp_parquet_sum_key[];
void kmp_parquet_sum(const char *bytes, size_t size, char sum[KMP_PARQUET_SUM + 1]);
