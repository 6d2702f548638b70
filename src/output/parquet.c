/* SPDX-License-Identifier: BSD-3-Clause */
/* Groups of rows, whose columns are pages of plain, uncompressed values (parquet.thrift of Apache Parquet 2.10;
 * Thrift's compact protocol). */
#include "output/parquet.h"
#include "base/cache/digest.h"
#include "base/memory.h"
#include "base/text.h"
#include "output/named_arrays.h"
#include "output/result_table.h"
#include <inttypes.h>
#include <kempe/kempe.h>
#include <limits.h>
#include <stdbool.h>
#include <stdio.h>
#include <string.h>

/* Types of Thrift's fields. */
enum { I32 = 5, I64 = 6, BINARY = 8, LIST = 9, STRUCT = 12 };
/* Numbers of Parquet. */
enum { DOUBLES = 5, BYTES = 6, REQUIRED = 0, UTF8 = 0, PLAIN = 0, LEVELS = 3, UNCOMPRESSED = 0, DATA_PAGE = 0 };

enum { PAGE_ROWS = 1 << 16 };

/* -- compact protocol -------------------------------------------------------------------------------- */

static void put_varint(kmp_text *text, uint64_t x)
{
    for (; x >= 0x80; x >>= 7)
        kmp_put_integer(text, (x & 0x7f) | 0x80, 1);
    kmp_put_integer(text, x, 1);
}

static void put_signed(kmp_text *text, int64_t x)
{
    put_varint(text, ((uint64_t)x << 1) ^ (x < 0 ? UINT64_MAX : 0));
}

static void put_string(kmp_text *text, const char *s)
{
    put_varint(text, strlen(s));
    kmp_text_append(text, s, strlen(s));
}

/* A field of a struct; *last: the field before it. */
static void put_field(kmp_text *text, int *last, int field, int type)
{
    kmp_put_integer(text, (uint64_t)(((field - *last) << 4) | type), 1);
    *last = field;
}

static void put_number(kmp_text *text, int *last, int field, int type, int64_t x)
{
    put_field(text, last, field, type);
    put_signed(text, x);
}

static void put_name(kmp_text *text, int *last, int field, const char *s)
{
    put_field(text, last, field, BINARY);
    put_string(text, s);
}

static void put_list(kmp_text *text, int *last, int field, int type, int count)
{
    put_field(text, last, field, LIST);
    kmp_put_integer(text, (uint64_t)((count < 15 ? count << 4 : 0xf0) | type), 1);
    if (count >= 15)
        put_varint(text, (uint64_t)count);
}

static void end_struct(kmp_text *text)
{
    kmp_put_integer(text, 0, 1);
}

const char kmp_parquet_sum_key[] = "kempe.sum";

void kmp_parquet_sum(const char *bytes, size_t size, char sum[KMP_PARQUET_SUM + 1])
{
    (void)snprintf(sum, KMP_PARQUET_SUM + 1, "%016" PRIx64, kmp_checksum(bytes, size));
}

/* -- columns ----------------------------------------------------------------------------------------- */

/* Place and size of the pages of a column in the file. */
typedef struct kmp_parquet_chunk {
    size_t at, size;
} chunk;

static void put_page(kmp_text *text, const kempe_table *t, int column, int first, int rows)
{
    const bool words = kmp_table_has_words(t, column);
    size_t size = words ? 0 : (size_t)rows * 8;
    for (int row = first; words && row < first + rows; row++)
        size += 4 + strlen(kempe_table_word(t, row, column));
    if (size > INT_MAX)
        text->failed = true;
    /* The header of the page. */
    int last = 0, inner = 0;
    put_number(text, &last, 1, I32, DATA_PAGE);
    put_number(text, &last, 2, I32, (int64_t)size);
    put_number(text, &last, 3, I32, (int64_t)size);
    put_field(text, &last, 5, STRUCT);
    put_number(text, &inner, 1, I32, rows);
    put_number(text, &inner, 2, I32, PLAIN);
    put_number(text, &inner, 3, I32, LEVELS);
    put_number(text, &inner, 4, I32, LEVELS);
    end_struct(text);
    end_struct(text);
    for (int row = first; row < first + rows; row++) {
        if (words) {
            const char *word = kempe_table_word(t, row, column);
            kmp_put_integer(text, strlen(word), 4);
            kmp_text_append(text, word, strlen(word));
        } else {
            char little[8];
            kmp_put_double(little, kempe_table_number(t, row, column));
            kmp_text_append(text, little, 8);
        }
    }
}

static chunk put_column(kmp_text *text, const kempe_table *t, int column)
{
    chunk c = {.at = text->length};
    int rows = kempe_table_row_count(t);
    for (int first = 0; first < rows || first == 0; first += PAGE_ROWS)
        put_page(text, t, column, first, rows - first < PAGE_ROWS ? rows - first : PAGE_ROWS);
    c.size = text->length - c.at;
    return c;
}

/* -- the end of the file ----------------------------------------------------------------------------- */

static void put_schema_element(kmp_text *text, const kempe_table *t, int column)
{
    int last = 0;
    bool words = kmp_table_has_words(t, column);
    put_number(text, &last, 1, I32, words ? BYTES : DOUBLES);
    put_number(text, &last, 3, I32, REQUIRED);
    put_name(text, &last, 4, kempe_table_column_name(t, column));
    if (words) {
        int kind = 0;
        put_number(text, &last, 6, I32, UTF8);
        put_field(text, &last, 10, STRUCT); /* LogicalType: STRING, a struct without fields */
        put_field(text, &kind, 1, STRUCT);
        end_struct(text);
        end_struct(text);
    }
    end_struct(text);
}

static void put_chunk(kmp_text *text, const kempe_table *t, int column, int rows, const chunk *c)
{
    int last = 0, meta = 0;
    put_number(text, &last, 2, I64, (int64_t)c->at);
    put_field(text, &last, 3, STRUCT);
    put_number(text, &meta, 1, I32, kmp_table_has_words(t, column) ? BYTES : DOUBLES);
    put_list(text, &meta, 2, I32, 1);
    put_signed(text, PLAIN);
    put_list(text, &meta, 3, BINARY, 1);
    put_string(text, kempe_table_column_name(t, column));
    put_number(text, &meta, 4, I32, UNCOMPRESSED);
    put_number(text, &meta, 5, I64, rows);
    put_number(text, &meta, 6, I64, (int64_t)c->size);
    put_number(text, &meta, 7, I64, (int64_t)c->size);
    put_number(text, &meta, 9, I64, (int64_t)c->at);
    end_struct(text);
    end_struct(text);
}

static void put_row_group(kmp_text *text, const kempe_table *t, int rows, const chunk *chunks)
{
    int last = 0, columns = kempe_table_column_count(t);
    size_t all = 0;
    put_list(text, &last, 1, STRUCT, columns);
    for (int c = 0; c < columns; c++) {
        put_chunk(text, t, c, rows, &chunks[c]);
        all += chunks[c].size;
    }
    put_number(text, &last, 2, I64, (int64_t)all);
    put_number(text, &last, 3, I64, rows);
    end_struct(text);
}

static void put_note(kmp_text *text, const char *key, const char *value)
{
    int last = 0;
    put_name(text, &last, 1, key);
    put_name(text, &last, 2, value);
    end_struct(text);
}

/* A sum of all bytes before its own. */
static void put_sum(kmp_text *text)
{
    char sum[KMP_PARQUET_SUM + 1] = "";
    int last = 0;
    put_name(text, &last, 1, kmp_parquet_sum_key);
    if (!text->failed)
        kmp_parquet_sum(text->s, text->length, sum);
    put_name(text, &last, 2, sum);
    end_struct(text);
}

/* The system of units where it is not SI, units of the columns, the status of the result, the caller's notes, and the
 * sum where there are notes. */
static void put_notes(kmp_text *text, int *last, const kempe_table *t, int note_count, const kmp_parquet_note *notes)
{
    int columns = kempe_table_column_count(t), count = note_count > 0 ? note_count + 1 : 0;
    for (int c = 0; c < columns; c++)
        count += *kempe_table_unit(t, c) != '\0';
    put_list(text, last, 5, STRUCT,
             count + (kmp_table_outcome(t) != KEMPE_OUTCOME_NONE) + (kmp_table_system(t) != NULL));
    if (kmp_table_outcome(t))
        put_note(text, "status", kempe_outcome_text(kmp_table_outcome(t)));
    if (kmp_table_system(t))
        put_note(text, "system", kmp_table_system(t));
    for (int c = 0; c < columns; c++) {
        kmp_text key = {0};
        if (!*kempe_table_unit(t, c))
            continue;
        kmp_text_printf(&key, "unit.%s", kempe_table_column_name(t, c));
        put_note(text, key.failed ? "" : key.s, kempe_table_unit(t, c));
        kmp_text_free_part(text, &key);
    }
    for (int k = 0; k < note_count; k++)
        put_note(text, notes[k].key, notes[k].value);
    if (note_count > 0)
        put_sum(text);
}

static void put_footer(kmp_text *text, const kempe_table *t, const kmp_parquet_groups *groups, int note_count,
                       const kmp_parquet_note *notes)
{
    int last = 0, root = 0, columns = kempe_table_column_count(t);
    int64_t rows = 0;
    size_t at = text->length;
    for (int k = 0; k < groups->count; k++)
        rows += groups->rows[k];
    put_number(text, &last, 1, I32, 1);
    put_list(text, &last, 2, STRUCT, columns + 1);
    put_name(text, &root, 4, "schema");
    put_number(text, &root, 5, I32, columns);
    end_struct(text);
    for (int c = 0; c < columns; c++)
        put_schema_element(text, t, c);
    put_number(text, &last, 3, I64, rows);
    put_list(text, &last, 4, STRUCT, groups->count);
    for (int k = 0; k < groups->count; k++)
        put_row_group(text, t, groups->rows[k], groups->chunks + (size_t)k * (size_t)columns);
    put_notes(text, &last, t, note_count, notes);
    put_name(text, &last, 6, "Kempe version " KEMPE_VERSION " (build 0)"); /* the form that readers parse */
    end_struct(text);
    kmp_put_integer(text, text->length - at, 4);
    kmp_text_put(text, "PAR1");
}

void kmp_parquet_begin(kmp_text *text)
{
    kmp_text_put(text, "PAR1");
}

void kmp_parquet_add(kmp_text *text, kmp_parquet_groups *groups, const kempe_table *table)
{
    size_t columns = (size_t)kempe_table_column_count(table), count = (size_t)groups->count;
    int *rows = kmp_realloc(groups->rows, count + 1, sizeof *rows);
    groups->rows = rows ? rows : groups->rows;
    chunk *chunks = rows ? kmp_realloc(groups->chunks, (count + 1) * columns + 1, sizeof *chunks) : NULL;
    groups->chunks = chunks ? chunks : groups->chunks;
    text->failed = text->failed || !chunks;
    if (!chunks)
        return;
    rows[count] = kempe_table_row_count(table);
    for (size_t c = 0; c < columns; c++) {
        chunks[count * columns + c] = put_column(text, table, (int)c);
        chunks[count * columns + c].at += groups->before;
    }
    groups->count++;
}

void kmp_parquet_end(kmp_text *text, kmp_parquet_groups *groups, const kempe_table *table)
{
    put_footer(text, table, groups, 0, NULL);
}

void kmp_parquet_groups_free(kmp_parquet_groups *groups)
{
    kmp_free(groups->rows);
    kmp_free(groups->chunks);
    *groups = (kmp_parquet_groups){0};
}

void kmp_parquet_put(kmp_text *text, const kempe_table *table, int note_count, const kmp_parquet_note *notes)
{
    kmp_parquet_groups groups = {0};
    kmp_parquet_begin(text);
    kmp_parquet_add(text, &groups, table);
    if (groups.count > 0)
        put_footer(text, table, &groups, note_count, notes);
    kmp_parquet_groups_free(&groups);
}
