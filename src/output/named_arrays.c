/* SPDX-License-Identifier: BSD-3-Clause */
/* Arrays as .npz and .mat: a writer for each format, and the choice by the ending of a name. */
#include "output/named_arrays.h"
#include "base/file.h"
#include "output/zip_archive.h"
#include <stdio.h>
#include <string.h>

/* -- entries --------------------------------------------------------------------------------------------- */

/* Appends all numbers in one of both orders. */
static void put_values(kmp_text *text, const kmp_named_array *array, bool by_rows)
{
    size_t count = 1;
    for (int d = 0; d < array->rank; d++)
        count *= (size_t)array->shape[d];
    for (size_t k = 0; k < count; k++) {
        char little[8];
        size_t place = k;
        if (by_rows != array->by_rows) { /* digits of k in the order of writing, read in the other order */
            size_t rest = k, stride = count;
            place = 0;
            for (int d = 0; d < array->rank; d++) {
                const size_t size = (size_t)array->shape[by_rows ? array->rank - 1 - d : d];
                stride /= size;
                place += rest % size * stride;
                rest /= size;
            }
        }
        kmp_put_double(little, array->values[place]);
        kmp_text_append(text, little, sizeof little);
    }
}

/* -- .mat ------------------------------------------------------------------------------------------------ */

/* Arrays in MATLAB's level 5 format, as MATLAB, Octave, SciPy and matio read it (MAT-File Format, The MathWorks,
 * chapter 1): elements of a type, a number of bytes, and the data filled up to eight bytes. Words are a cell array of
 * texts. A writer of ours, since matio puts the date into the file: equal results would have unequal bytes. */

/* Types of data, and classes of arrays, with their numbers in the format. */
enum { INT8 = 1, UINT16 = 4, INT32 = 5, UINT32 = 6, DOUBLE = 9, MATRIX = 14 };
enum { CELLS = 1, TEXT = 4, NUMBERS = 6 };

/* The largest element, whose size has 32 bits. */
#define MOST_BYTES 0xffffff00u

/* The tag of an element, and its end once the data are there. */
static size_t begin(kmp_text *text, int type)
{
    kmp_put_integer(text, (uint64_t)type, 4);
    kmp_put_integer(text, 0, 4);
    return text->length;
}

static void end(kmp_text *text, size_t data)
{
    size_t size = text->length - data;
    if (text->failed || size > MOST_BYTES) {
        text->failed = true;
        return;
    }
    kmp_put_little(text->s + data - 4, size, 4);
    static const char zeros[8];
    kmp_text_append(text, zeros, (8 - text->length % 8) % 8);
}

/* An array up to its data; of two indices or more. */
static size_t begin_array(kmp_text *text, int class, const char *name, int rank, const int *shape)
{
    size_t array = begin(text, MATRIX), part = begin(text, UINT32);
    kmp_put_integer(text, (uint64_t) class, 8);
    end(text, part);
    part = begin(text, INT32);
    for (int d = 0; d < (rank > 2 ? rank : 2); d++)
        kmp_put_integer(text, d < rank ? (uint64_t)shape[d] : 1, 4);
    end(text, part);
    part = begin(text, INT8);
    kmp_text_append(text, name, strlen(name));
    end(text, part);
    return array;
}

/* Characters beyond ASCII become '?', as in .npz. */
static void put_word(kmp_text *text, const char *word)
{
    const int shape[2] = {*word != '\0', (int)strlen(word)};
    size_t array = begin_array(text, TEXT, "", 2, shape), data = begin(text, UINT16);
    for (; *word; word++)
        kmp_put_integer(text, (unsigned char)*word < 128 ? (unsigned char)*word : '?', 2);
    end(text, data);
    end(text, array);
}

static void put_array(kmp_text *text, const kmp_named_array *a)
{
    size_t array = begin_array(text, a->values ? NUMBERS : CELLS, a->name, a->rank, a->shape);
    if (a->values) {
        size_t data = begin(text, DOUBLE);
        put_values(text, a, false);
        end(text, data);
    } else {
        for (int k = 0; k < a->shape[0]; k++)
            put_word(text, a->word[k]);
    }
    end(text, array);
}

/* The arrays in MATLAB's format. */
static kempe_status mat_write(kempe_context *context, const kmp_arrays *arrays, const char *path)
{
    kmp_text text = {0};
    kmp_text_printf(&text, "%-124s", "MATLAB 5.0 MAT-file, written by Kempe");
    kmp_put_integer(&text, 0x0100, 2);
    kmp_text_put(&text, "IM"); /* little-endian */
    for (int k = 0; k < arrays->count; k++)
        put_array(&text, &arrays->array[k]);
    return kmp_file_write(context, path, &text);
}

/* -- .npz ------------------------------------------------------------------------------------------------ */

/* Arrays in NumPy's format 1.0 (numpy.lib.format), row by row, in a zip archive. Words are fixed-width text of
 * 32-bit characters; characters beyond ASCII become '?'. */

/* Appends a header; `type` as NumPy writes it. */
static void put_head(kmp_text *text, const kmp_named_array *of, const char *type)
{
    char head[256], shape[KMP_ARRAY_RANK_MOST * 16] = "";
    int written = 0;
    for (int d = 0; d < of->rank; d++)
        written += snprintf(shape + written, sizeof shape - (size_t)written, "%s%d", d > 0 ? ", " : "", of->shape[d]);
    int length = snprintf(head + 10, sizeof head - 10, "{'descr': '%s', 'fortran_order': False, 'shape': (%s%s), }",
                          type, shape, of->rank == 1 ? "," : "");
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
    for (int k = 0; k < of->shape[0]; k++)
        width = strlen(of->word[k]) > width ? strlen(of->word[k]) : width;
    snprintf(type, sizeof type, "<U%zu", width);
    put_head(text, of, type);
    for (int k = 0; k < of->shape[0]; k++)
        for (size_t i = 0, end = strlen(of->word[k]); i < width; i++) {
            unsigned char c = i < end ? (unsigned char)of->word[k][i] : 0;
            kmp_put_integer(text, c < 128 ? c : '?', 4);
        }
}

/* The arrays in NumPy's format. */
static kempe_status npz_write(kempe_context *context, const kmp_arrays *arrays, const char *path)
{
    kmp_zip zip = {.wide = true};
    for (int k = 0; k < arrays->count; k++) {
        kmp_text name = {0};
        kmp_text_printf(&name, "%s.npy", arrays->array[k].name);
        kmp_zip_begin(&zip, name.s);
        if (arrays->array[k].values) {
            put_head(&zip.text, &arrays->array[k], "<f8");
            put_values(&zip.text, &arrays->array[k], true);
        } else {
            put_words(&zip.text, &arrays->array[k]);
        }
        kmp_zip_end_member(&zip);
        kmp_text_free(&name);
    }
    kmp_text text = kmp_zip_end(&zip);
    return kmp_file_write(context, path, &text);
}

typedef struct format {
    const char *ending;
    kempe_status (*write)(kempe_context *context, const kmp_arrays *arrays, const char *path);
} format;

static const format formats[] = {{".npz", npz_write}, {".mat", mat_write}};

enum { FORMATS = sizeof formats / sizeof *formats };

static const double none; /* the values of an array without entries */

static void add(kmp_arrays *arrays, kmp_named_array array)
{
    arrays->failed = arrays->failed || arrays->count == KMP_ARRAYS_MOST;
    if (!arrays->failed)
        arrays->array[arrays->count++] = array;
}

void kmp_arrays_words(kmp_arrays *arrays, const char *name, int count, char *const *word)
{
    add(arrays, (kmp_named_array){.name = name, .rank = 1, .shape = {count}, .word = word});
}

void kmp_arrays_matrix(kmp_arrays *arrays, const char *name, int rows, int columns, const double *values)
{
    const int rank = columns == KMP_ARRAY_VECTOR ? 1 : 2;
    add(arrays,
        (kmp_named_array){
            .name = name, .rank = rank, .shape = {rows, rank > 1 ? columns : 0}, .values = values ? values : &none});
}

void kmp_arrays_tensor(kmp_arrays *arrays, const char *name, int rank, const int *shape, const double *values)
{
    kmp_named_array array = {.name = name, .rank = rank, .by_rows = true, .values = values ? values : &none};
    for (int d = 0; d < rank; d++)
        array.shape[d] = shape[d];
    add(arrays, array);
}

static const format *format_of(const char *ending)
{
    for (int k = 0; ending && k < FORMATS; k++)
        if (strcmp(ending, formats[k].ending) == 0)
            return &formats[k];
    return NULL;
}

bool kmp_arrays_ending(const char *ending)
{
    return format_of(ending);
}

kempe_status kmp_arrays_write(kempe_context *context, const kmp_arrays *arrays, const char *path)
{
    const format *f = format_of(kmp_file_ending(path));
    if (!f)
        return kmp_fail(context, KEMPE_E_ARGUMENT, "%s: arrays are written as .npz or .mat", path);
    return arrays->failed ? kmp_fail_memory(context) : f->write(context, arrays, path);
}

void kmp_put_little(char *to, uint64_t bits, int bytes)
{
    for (int i = 0; i < bytes; i++)
        to[i] = (char)(bits >> (8 * i));
}

void kmp_put_integer(kmp_text *text, uint64_t value, int bytes)
{
    char little[8];
    kmp_put_little(little, value, bytes);
    kmp_text_append(text, little, (size_t)bytes);
}

void kmp_put_double(char *to, double x)
{
    uint64_t bits;
    memcpy(&bits, &x, sizeof bits);
    kmp_put_little(to, bits, 8);
}
