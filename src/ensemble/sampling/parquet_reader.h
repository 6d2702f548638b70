/* SPDX-License-Identifier: BSD-3-Clause */
/* Parquet files of flat columns whose values are plain and uncompressed: the files that Kempe writes, and files that
 * other tools write in this form on request. Everything else is refused by its name. */
#pragma once

#include "base/arena.h"
#include "output/parquet.h"

typedef struct kmp_parquet_column {
    const char *name, *unit; /* unit "": none */
    double *number;          /* NULL: words */
    const char **word;
} kmp_parquet_column;

/** The content of a file; zero initially. */
typedef struct kmp_parquet_file {
    kmp_arena arena;
    int rows, column_count, note_count;
    kmp_parquet_column *column;
    kmp_parquet_note *note; /* key-value metadata */
    bool sum_holds;         /* it has a sum of its bytes, which is right */
} kmp_parquet_file;

/** Reads a file. KEMPE_E_IO; KEMPE_E_INPUT: it is not such a file, and a sentence says why. */
kempe_status kmp_parquet_read(kempe_context *context, const char *path, kmp_parquet_file *file);
void kmp_parquet_file_free(kmp_parquet_file *file);

/** The value of a key, the last one where it occurs twice; "": there is none. */
const char *kmp_parquet_value(const kmp_parquet_file *file, const char *key);
/** A column by its name; -1: there is none. */
int kmp_parquet_find(const kmp_parquet_file *file, const char *name);
