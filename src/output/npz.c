/* SPDX-License-Identifier: BSD-3-Clause */
#include "output/npz.h"
#include "base/memory.h"
#include <stdint.h>
#include <stdio.h>
#include <string.h>
#include <zip.h>

/* -- arrays ------------------------------------------------------------------------------------------ */

/* A header and room for the data; `type` as NumPy writes it. NULL: no memory. */
static kmp_npy *add(kmp_npz *npz, const char *name, const char *type, int rows, int columns, size_t item)
{
    char head[256];
    if (npz->failed || npz->count == KMP_NPZ_MOST) {
        npz->failed = true;
        return NULL;
    }
    kmp_npy *a = &npz->array[npz->count];
    int length = snprintf(head + 10, sizeof head - 10,
                          columns >= 0 ? "{'descr': '%s', 'fortran_order': False, 'shape': (%d, %d), }"
                                       : "{'descr': '%s', 'fortran_order': False, 'shape': (%d,), }",
                          type, rows, columns);
    size_t whole = ((size_t)length + 11 + 63) / 64 * 64, text = whole - 10;
    memset(head + 10 + length, ' ', whole - 10 - (size_t)length);
    for (int i = 0; i < 8; i++)
        head[i] = "\x93NUMPY\x01\x00"[i];
    head[8] = (char)(text & 0xff);
    head[9] = (char)(text >> 8);
    head[whole - 1] = '\n';
    a->name = name;
    a->head = whole;
    a->size = whole + (size_t)rows * (size_t)(columns >= 0 ? columns : 1) * item;
    a->bytes = kmp_calloc(a->size, 1);
    npz->failed = !a->bytes;
    if (npz->failed)
        return NULL;
    memcpy(a->bytes, head, whole);
    npz->count++;
    return a;
}

void kmp_npz_words(kmp_npz *npz, const char *name, int count, char *const *word)
{
    size_t width = 1;
    char type[32];
    for (int k = 0; k < count; k++)
        width = strlen(word[k]) > width ? strlen(word[k]) : width;
    snprintf(type, sizeof type, "<U%zu", width);
    kmp_npy *a = add(npz, name, type, count, KMP_NPZ_VECTOR, 4 * width);
    for (int k = 0; a && k < count; k++)
        for (size_t i = 0; word[k][i]; i++) {
            unsigned char c = (unsigned char)word[k][i];
            a->bytes[a->head + 4 * (width * (size_t)k + i)] = (char)(c < 128 ? c : '?');
        }
}

kmp_npy *kmp_npz_values(kmp_npz *npz, const char *name, int rows, int columns)
{
    return add(npz, name, "<f8", rows, columns, 8);
}

/* Little-endian doubles on any machine. */
void kmp_npy_put(kmp_npy *array, size_t index, double x)
{
    uint64_t bits;
    memcpy(&bits, &x, sizeof bits);
    for (size_t i = 0; i < 8; i++)
        array->bytes[array->head + 8 * index + i] = (char)(bits >> (8 * i));
}

void kmp_npz_matrix(kmp_npz *npz, const char *name, int rows, int columns, const double *values)
{
    kmp_npy *a = kmp_npz_values(npz, name, rows, columns);
    int across = columns >= 0 ? columns : 1;
    for (int i = 0; a && i < rows; i++)
        for (int k = 0; k < across; k++)
            kmp_npy_put(a, (size_t)i * (size_t)across + (size_t)k, values[i + k * rows]);
}

/* -- the archive ------------------------------------------------------------------------------------- */

/* Adds an array to the archive, which copies nothing: the bytes must stay until it is closed. */
static bool put_array(zip_t *archive, const kmp_npy *a)
{
    char name[64];
    (void)snprintf(name, sizeof name, "%s.npy", a->name);
    zip_source_t *source = zip_source_buffer(archive, a->bytes, a->size, 0);
    zip_int64_t index = source ? zip_file_add(archive, name, source, ZIP_FL_OVERWRITE) : -1;
    if (source && index < 0)
        zip_source_free(source);
    /* no compression and one date: equal arrays give equal bytes */
    return index >= 0 && zip_set_file_compression(archive, (zip_uint64_t)index, ZIP_CM_STORE, 0) == 0 &&
           zip_file_set_dostime(archive, (zip_uint64_t)index, 0, 0x21, 0) == 0;
}

/* libzip writes a temporary file in the same folder and renames it. */
kempe_status kmp_npz_write(kempe_context *context, kmp_npz *npz, const char *path)
{
    if (npz->failed)
        return kmp_fail_memory(context);
    int code = 0;
    zip_t *archive = zip_open(path, ZIP_CREATE | ZIP_TRUNCATE, &code);
    bool ok = archive;
    for (int k = 0; ok && k < npz->count; k++)
        ok = put_array(archive, &npz->array[k]);
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

void kmp_npz_free(kmp_npz *npz)
{
    for (int k = 0; k < npz->count; k++)
        kmp_free(npz->array[k].bytes);
    *npz = (kmp_npz){0};
}
