/* SPDX-License-Identifier: BSD-3-Clause */
/* Arrays in NumPy's format 1.0 (numpy.lib.format), in a zip (libzip): row by row. Words are fixed-width text of 32-bit
 * characters; characters beyond ASCII become '?'. */
#include "base/memory.h"
#include "output/formats/named_arrays.h"
#include <stdio.h>
#include <string.h>
#include <zip.h>

/* The bytes of one .npy. */
typedef struct npy {
    char *bytes;
    size_t head, size;
} npy;

/* -- arrays ------------------------------------------------------------------------------------------ */

/* A header and room for the data; `type` as NumPy writes it. `bytes` NULL: no memory. */
static npy make(const kmp_named_array *of, const char *type, size_t item)
{
    char head[256];
    int length = snprintf(head + 10, sizeof head - 10,
                          of->columns >= 0 ? "{'descr': '%s', 'fortran_order': False, 'shape': (%d, %d), }"
                                           : "{'descr': '%s', 'fortran_order': False, 'shape': (%d,), }",
                          type, of->rows, of->columns);
    size_t whole = ((size_t)length + 11 + 63) / 64 * 64, text = whole - 10;
    memset(head + 10 + length, ' ', whole - 10 - (size_t)length);
    for (int i = 0; i < 8; i++)
        head[i] = "\x93NUMPY\x01\x00"[i];
    kmp_put_little(head + 8, text, 2);
    head[whole - 1] = '\n';
    npy a = {.head = whole, .size = whole + (size_t)of->rows * (size_t)kmp_array_across(of) * item};
    a.bytes = kmp_calloc(a.size, 1);
    if (a.bytes)
        memcpy(a.bytes, head, whole);
    return a;
}

static npy make_words(const kmp_named_array *of)
{
    size_t width = 1;
    char type[32];
    for (int k = 0; k < of->rows; k++)
        width = strlen(of->word[k]) > width ? strlen(of->word[k]) : width;
    snprintf(type, sizeof type, "<U%zu", width);
    npy a = make(of, type, 4 * width);
    for (int k = 0; a.bytes && k < of->rows; k++)
        for (size_t i = 0; of->word[k][i]; i++) {
            unsigned char c = (unsigned char)of->word[k][i];
            a.bytes[a.head + 4 * (width * (size_t)k + i)] = (char)(c < 128 ? c : '?');
        }
    return a;
}

static npy make_numbers(const kmp_named_array *of)
{
    int across = kmp_array_across(of);
    npy a = make(of, "<f8", 8);
    for (int i = 0; a.bytes && i < of->rows; i++)
        for (int k = 0; k < across; k++)
            kmp_put_double(a.bytes + a.head + 8 * ((size_t)i * (size_t)across + (size_t)k),
                           of->values[i + (ptrdiff_t)k * of->rows]);
    return a;
}

/* -- the archive ------------------------------------------------------------------------------------- */

/* Adds an array to the archive, which copies nothing: the bytes must stay until it is closed. */
static bool put_array(zip_t *archive, const char *array, const npy *a)
{
    char name[64];
    (void)snprintf(name, sizeof name, "%s.npy", array);
    zip_source_t *source = a->bytes ? zip_source_buffer(archive, a->bytes, a->size, 0) : NULL;
    zip_int64_t index = source ? zip_file_add(archive, name, source, ZIP_FL_OVERWRITE) : -1;
    if (source && index < 0)
        zip_source_free(source);
    /* no compression and one date: equal arrays give equal bytes */
    return index >= 0 && zip_set_file_compression(archive, (zip_uint64_t)index, ZIP_CM_STORE, 0) == 0 &&
           zip_file_set_dostime(archive, (zip_uint64_t)index, 0, 0x21, 0) == 0;
}

/* libzip writes a temporary file in the same folder and renames it. */
static kempe_status write_archive(kempe_context *context, const kmp_arrays *arrays, const npy *made, const char *path)
{
    int code = 0;
    zip_t *archive = zip_open(path, ZIP_CREATE | ZIP_TRUNCATE, &code);
    bool ok = archive;
    for (int k = 0; ok && k < arrays->count; k++)
        ok = put_array(archive, arrays->array[k].name, &made[k]);
    if (ok && zip_close(archive) == 0)
        return KEMPE_OK;
    zip_error_t error;
    zip_error_init_with_code(&error, code);
    kempe_status status = kmp_fail(context, KEMPE_E_IO, "%s: cannot be written: %s", path,
                                   archive ? zip_strerror(archive) : zip_error_strerror(&error));
    zip_error_fini(&error);
    if (archive)
        zip_discard(archive);
    return status;
}

kempe_status kmp_npz_write(kempe_context *context, const kmp_arrays *arrays, const char *path)
{
    npy made[KMP_ARRAYS_MOST] = {0};
    bool all = true;
    for (int k = 0; all && k < arrays->count; k++) {
        const kmp_named_array *of = &arrays->array[k];
        made[k] = of->values ? make_numbers(of) : make_words(of);
        all = made[k].bytes;
    }
    kempe_status status = all ? write_archive(context, arrays, made, path) : kmp_fail_memory(context);
    for (int k = 0; k < arrays->count; k++)
        kmp_free(made[k].bytes);
    return status;
}
