/* SPDX-License-Identifier: BSD-3-Clause */
/* Arrays in NumPy's format 1.0 (numpy.lib.format), row by row, in a zip archive without compression (APPNOTE.TXT 6.3,
 * PKWARE). All sizes are written with 64 bits, as NumPy does. Words are fixed-width text of 32-bit characters;
 * characters beyond ASCII become '?'. A writer of ours: one date for all, so that equal arrays give equal bytes, and no
 * library. */
#include "base/file.h"
#include "output/formats/named_arrays.h"
#include <stdio.h>
#include <string.h>

/* -- arrays ------------------------------------------------------------------------------------------ */

/* Appends a header; `type` as NumPy writes it. */
static void put_head(kmp_text *text, const kmp_named_array *of, const char *type)
{
    char head[256];
    int length = snprintf(head + 10, sizeof head - 10,
                          of->columns >= 0 ? "{'descr': '%s', 'fortran_order': False, 'shape': (%d, %d), }"
                                           : "{'descr': '%s', 'fortran_order': False, 'shape': (%d,), }",
                          type, of->rows, of->columns);
    size_t whole = ((size_t)length + 11 + 63) / 64 * 64;
    memset(head + 10 + length, ' ', whole - 10 - (size_t)length);
    for (int i = 0; i < 8; i++)
        head[i] = "\x93NUMPY\x01\x00"[i];
    kmp_put_little(head + 8, whole - 10, 2);
    head[whole - 1] = '\n';
    kmp_text_append(text, head, whole);
}

static void put_words(kmp_text *text, const kmp_named_array *of)
{
    size_t width = 1;
    char type[32];
    for (int k = 0; k < of->rows; k++)
        width = strlen(of->word[k]) > width ? strlen(of->word[k]) : width;
    snprintf(type, sizeof type, "<U%zu", width);
    put_head(text, of, type);
    for (int k = 0; k < of->rows; k++)
        for (size_t i = 0, end = strlen(of->word[k]); i < width; i++) {
            unsigned char c = i < end ? (unsigned char)of->word[k][i] : 0;
            kmp_put_integer(text, c < 128 ? c : '?', 4);
        }
}

static void put_numbers(kmp_text *text, const kmp_named_array *of)
{
    put_head(text, of, "<f8");
    for (int i = 0; i < of->rows; i++)
        for (int k = 0; k < kmp_array_across(of); k++) {
            char little[8];
            kmp_put_double(little, of->values[i + (ptrdiff_t)k * of->rows]);
            kmp_text_append(text, little, sizeof little);
        }
}

/* -- the archive ------------------------------------------------------------------------------------- */

/* The places of the format, and what stands in those of 32 bits where a field of 64 follows. */
enum { VERSION = 45, DATE = 0x21, LONG = 1, CHECKSUM_AT = 14 };
#define ELSEWHERE 0xffffffffu

/* A file in the archive. */
typedef struct member {
    const char *array;
    size_t at, size; /* of its local header; of its data */
    uint32_t checksum;
} member;

/* CRC-32, a byte at a time (ISO 3309). */
static uint32_t checksum(const char *bytes, size_t size)
{
    uint32_t table[256], sum = ELSEWHERE;
    for (uint32_t k = 0; k < 256; k++) {
        table[k] = k;
        for (int i = 0; i < 8; i++)
            table[k] = table[k] & 1 ? table[k] >> 1 ^ 0xedb88320u : table[k] >> 1;
    }
    for (size_t k = 0; k < size; k++)
        sum = table[(sum ^ (unsigned char)bytes[k]) & 0xff] ^ sum >> 8;
    return ~sum;
}

/* The local and the central header have these fields after their signatures, up to the length of the name. */
static void put_facts(kmp_text *text, const member *m)
{
    kmp_put_integer(text, VERSION, 2);
    kmp_put_integer(text, 0, 6); /* flags, no compression, no time */
    kmp_put_integer(text, DATE, 2);
    kmp_put_integer(text, m->checksum, 4);
    kmp_put_integer(text, ELSEWHERE, 4);
    kmp_put_integer(text, ELSEWHERE, 4);
    kmp_put_integer(text, strlen(m->array) + strlen(".npy"), 2);
}

static void put_name(kmp_text *text, const member *m)
{
    kmp_text_put(text, m->array);
    kmp_text_put(text, ".npy");
}

/* The field of 64-bit sizes, `more` bytes longer than for them. */
static void put_sizes(kmp_text *text, const member *m, int more)
{
    kmp_put_integer(text, LONG, 2);
    kmp_put_integer(text, 16 + (uint64_t)more, 2);
    kmp_put_integer(text, m->size, 8);
    kmp_put_integer(text, m->size, 8);
}

static void put_local_header(kmp_text *text, const member *m)
{
    kmp_put_integer(text, 0x04034b50, 4);
    put_facts(text, m);
    kmp_put_integer(text, 20, 2);
    put_name(text, m);
    put_sizes(text, m, 0);
}

/* A file; its checksum and size are known after its data. */
static member put_file(kmp_text *text, const kmp_named_array *of)
{
    member m = {.array = of->name, .at = text->length};
    put_local_header(text, &m);
    size_t data = text->length;
    if (of->values)
        put_numbers(text, of);
    else
        put_words(text, of);
    if (text->failed)
        return m;
    m.size = text->length - data;
    m.checksum = checksum(text->s + data, m.size);
    kmp_put_little(text->s + m.at + CHECKSUM_AT, m.checksum, 4);
    kmp_put_little(text->s + data - 16, m.size, 8);
    kmp_put_little(text->s + data - 8, m.size, 8);
    return m;
}

static void put_central_header(kmp_text *text, const member *m)
{
    kmp_put_integer(text, 0x02014b50, 4);
    kmp_put_integer(text, VERSION, 2);
    put_facts(text, m);
    kmp_put_integer(text, 28, 2);
    kmp_put_integer(text, 0, 8); /* no comment, the first disk, no attributes of a text */
    kmp_put_integer(text, 0, 2);
    kmp_put_integer(text, ELSEWHERE, 4);
    put_name(text, m);
    put_sizes(text, m, 8);
    kmp_put_integer(text, m->at, 8);
}

static void put_end(kmp_text *text, size_t directory, int count)
{
    size_t end = text->length;
    kmp_put_integer(text, 0x06064b50, 4);
    kmp_put_integer(text, 44, 8); /* of what follows in this record */
    kmp_put_integer(text, VERSION, 2);
    kmp_put_integer(text, VERSION, 2);
    kmp_put_integer(text, 0, 8); /* the first disk */
    kmp_put_integer(text, (uint64_t)count, 8);
    kmp_put_integer(text, (uint64_t)count, 8);
    kmp_put_integer(text, end - directory, 8);
    kmp_put_integer(text, directory, 8);
    kmp_put_integer(text, 0x07064b50, 4);
    kmp_put_integer(text, 0, 4);
    kmp_put_integer(text, end, 8);
    kmp_put_integer(text, 1, 4); /* disks */
    kmp_put_integer(text, 0x06054b50, 4);
    kmp_put_integer(text, 0, 4);
    kmp_put_integer(text, ELSEWHERE, 4); /* twice the number of files */
    kmp_put_integer(text, ELSEWHERE, 4);
    kmp_put_integer(text, ELSEWHERE, 4);
    kmp_put_integer(text, 0, 2); /* no comment */
}

kempe_status kmp_npz_write(kempe_context *context, const kmp_arrays *arrays, const char *path)
{
    kmp_text text = {0};
    member made[KMP_ARRAYS_MOST];
    for (int k = 0; k < arrays->count; k++)
        made[k] = put_file(&text, &arrays->array[k]);
    size_t directory = text.length;
    for (int k = 0; k < arrays->count; k++)
        put_central_header(&text, &made[k]);
    put_end(&text, directory, arrays->count);
    return kmp_file_write(context, path, &text);
}
