/* SPDX-License-Identifier: BSD-3-Clause */
/* Arrays in NumPy's format 1.0 (numpy.lib.format), row by row, in a zip archive. Words are fixed-width text of
 * 32-bit characters; characters beyond ASCII become '?'. */
#include "output/npz.h"
#include "base/file.h"
#include "output/named_arrays.h"
#include "output/zip_archive.h"
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

kempe_status kmp_npz_write(kempe_context *context, const kmp_arrays *arrays, const char *path)
{
    kmp_zip zip = {.wide = true};
    for (int k = 0; k < arrays->count; k++) {
        kmp_text name = {0};
        kmp_text_printf(&name, "%s.npy", arrays->array[k].name);
        kmp_zip_begin(&zip, name.s);
        if (arrays->array[k].values)
            put_numbers(&zip.text, &arrays->array[k]);
        else
            put_words(&zip.text, &arrays->array[k]);
        kmp_zip_end_member(&zip);
        kmp_text_free(&name);
    }
    kmp_text text = kmp_zip_end(&zip);
    return kmp_file_write(context, path, &text);
}
