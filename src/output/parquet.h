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

/** A file of several groups of rows, whose texts are written and emptied between the calls: begin, add for each table,
 * all with the same columns, end with any of them. */
typedef struct kmp_parquet_groups {
    size_t before; /* bytes of the texts that were emptied: the caller adds them */
    int count;
    int *rows;                        /* of each group */
    struct kmp_parquet_chunk *chunks; /* of each column of each group */
} kmp_parquet_groups;
void kmp_parquet_begin(kmp_text *text);
void kmp_parquet_add(kmp_text *text, kmp_parquet_groups *groups, const kempe_table *table);
void kmp_parquet_end(kmp_text *text, kmp_parquet_groups *groups, const kempe_table *table);
void kmp_parquet_groups_free(kmp_parquet_groups *groups);

/** The sum of `size` bytes at the beginning of a file, and its key. */
enum { KMP_PARQUET_SUM = 16 };
extern const char kmp_parquet_sum_key[];
void kmp_parquet_sum(const char *bytes, size_t size, char sum[KMP_PARQUET_SUM + 1]);
