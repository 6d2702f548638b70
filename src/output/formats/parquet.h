/* SPDX-License-Identifier: BSD-3-Clause */
/* Tables as Apache Parquet files: for pandas, Polars, DuckDB, Spark. Equal tables give equal bytes. */
#pragma once

#include "base/text.h"
#include <kempe/table.h>

/** Appends the file of a table. Columns are required doubles, unknown numbers NaN, or UTF-8 words. The units are in the
 * key-value metadata, "unit.NAME" for each column that has one. */
void kmp_parquet_put(kmp_text *text, const kempe_table *table);
