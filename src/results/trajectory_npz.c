/* SPDX-License-Identifier: BSD-3-Clause */
/* A trajectory as NumPy reads it: one array a column group, and the names and units as text. The container is a zip
 * (libzip), the arrays are in NumPy's format 1.0 (numpy.lib.format). */
#include "base/memory.h"
#include "results/columns.h"
#include <math.h>
#include <stdint.h>
#include <stdio.h>
#include <string.h>
#include <zip.h>

/* The bytes of one .npy. */
typedef struct array {
    char *bytes;
    size_t head, size;
} array;

/* A header and room for the data; `type` as NumPy writes it. false: no memory. */
static bool array_init(array *a, const char *type, int rows, int columns, size_t item)
{
    char head[256];
    int length = snprintf(head + 10, sizeof head - 10,
                          columns ? "{'descr': '%s', 'fortran_order': False, 'shape': (%d, %d), }"
                                  : "{'descr': '%s', 'fortran_order': False, 'shape': (%d,), }",
                          type, rows, columns);
    size_t whole = ((size_t)length + 11 + 63) / 64 * 64, text = whole - 10;
    memset(head + 10 + length, ' ', whole - 10 - (size_t)length);
    for (int i = 0; i < 8; i++)
        head[i] = "\x93NUMPY\x01\x00"[i];
    head[8] = (char)(text & 0xff);
    head[9] = (char)(text >> 8);
    head[whole - 1] = '\n';
    a->head = whole;
    a->size = whole + (size_t)rows * (size_t)(columns ? columns : 1) * item;
    a->bytes = kmp_calloc(a->size, 1);
    if (a->bytes)
        memcpy(a->bytes, head, whole);
    return a->bytes;
}

/* Names as fixed-width text of 32-bit characters; UTF-8 beyond ASCII becomes '?'. */
static bool array_of_words(array *a, char *const *word, int count)
{
    size_t width = 1;
    char type[32];
    for (int k = 0; k < count; k++)
        width = strlen(word[k]) > width ? strlen(word[k]) : width;
    snprintf(type, sizeof type, "<U%zu", width);
    if (!array_init(a, type, count, 0, 4 * width))
        return false;
    for (int k = 0; k < count; k++)
        for (size_t i = 0; word[k][i]; i++) {
            unsigned char c = (unsigned char)word[k][i];
            a->bytes[a->head + 4 * (width * (size_t)k + i)] = (char)(c < 128 ? c : '?');
        }
    return true;
}

/* Little-endian doubles, whatever the machine. */
static void put_double(array *a, size_t index, double x)
{
    uint64_t bits;
    memcpy(&bits, &x, sizeof bits);
    for (size_t i = 0; i < 8; i++)
        a->bytes[a->head + 8 * index + i] = (char)(bits >> (8 * i));
}

static bool array_of_values(array *a, const kempe_trajectory *trajectory, const kmp_columns *columns, kmp_plant *plant)
{
    double *row = KMP_NEW(double, columns->count);
    int rows = trajectory->table.rows;
    bool ok = row && array_init(a, "<f8", rows, columns->count, 8);
    for (int r = 0; ok && r < rows; r++) {
        kmp_columns_fill(trajectory, plant, r, row);
        for (int k = 0; k < columns->count; k++)
            put_double(a, (size_t)r * (size_t)columns->count + (size_t)k, row[k]);
    }
    kmp_free(row);
    return ok;
}

/* Adds an array to the archive, which copies nothing: the bytes must stay until it is closed. */
static bool add_array(zip_t *archive, const char *name, const array *a)
{
    zip_source_t *source = zip_source_buffer(archive, a->bytes, a->size, 0);
    zip_int64_t index = source ? zip_file_add(archive, name, source, ZIP_FL_OVERWRITE) : -1;
    if (source && index < 0)
        zip_source_free(source);
    /* no compression and one date: the same trajectory gives the same bytes */
    return index >= 0 && zip_set_file_compression(archive, (zip_uint64_t)index, ZIP_CM_STORE, 0) == 0 &&
           zip_file_set_dostime(archive, (zip_uint64_t)index, 0, 0x21, 0) == 0;
}

/* libzip writes beside the file and renames. */
static kempe_status write_archive(const kempe_system *system, const char *path, const array *arrays)
{
    static const char *const name[] = {"names.npy", "units.npy", "values.npy"};
    int code = 0;
    zip_t *archive = zip_open(path, ZIP_CREATE | ZIP_TRUNCATE, &code);
    bool ok = archive;
    for (int k = 0; ok && k < 3; k++)
        ok = add_array(archive, name[k], &arrays[k]);
    if (ok && zip_close(archive) == 0)
        return KEMPE_OK;
    zip_error_t error;
    zip_error_init_with_code(&error, code);
    kempe_status status = kmp_fail(system->context, KEMPE_E_IO, "%s: cannot be written: %s", path,
                                   archive ? zip_strerror(archive) : zip_error_strerror(&error));
    zip_error_fini(&error);
    if (archive)
        zip_discard(archive);
    return status;
}

kempe_status kempe_trajectory_write_npz(const kempe_trajectory *trajectory, const char *path)
{
    const kempe_system *system = trajectory->system;
    kmp_context_clear(system->context);
    kmp_plant *plant = kmp_plant_new(system, trajectory->backend);
    if (!plant)
        return KEMPE_E_MEMORY;
    kmp_columns columns;
    array arrays[3] = {{0}};
    bool ok = kmp_columns_init(&columns, system) && array_of_words(&arrays[0], columns.name, columns.count) &&
              array_of_words(&arrays[1], columns.unit, columns.count) &&
              array_of_values(&arrays[2], trajectory, &columns, plant);
    kempe_status status = ok ? write_archive(system, path, arrays) : kmp_fail_memory(system->context);
    for (int k = 0; k < 3; k++)
        kmp_free(arrays[k].bytes);
    kmp_columns_free(&columns);
    kmp_plant_free(plant);
    return status;
}
