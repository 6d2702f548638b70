/* SPDX-License-Identifier: BSD-3-Clause */
#include "output/named_arrays.h"
#include "base/file.h"
#include "output/mat_file.h"
#include "output/npz.h"
#include <string.h>

typedef struct format {
    const char *ending;
    kempe_status (*write)(kempe_context *context, const kmp_arrays *arrays, const char *path);
} format;

static const format formats[] = {{".npz", kmp_npz_write}, {".mat", kmp_mat_write}};

enum { FORMATS = sizeof formats / sizeof *formats };

static void add(kmp_arrays *arrays, kmp_named_array array)
{
    arrays->failed = arrays->failed || arrays->count == KMP_ARRAYS_MOST;
    if (!arrays->failed)
        arrays->array[arrays->count++] = array;
}

void kmp_arrays_words(kmp_arrays *arrays, const char *name, int count, char *const *word)
{
    add(arrays, (kmp_named_array){name, count, KMP_ARRAY_VECTOR, NULL, word});
}

void kmp_arrays_matrix(kmp_arrays *arrays, const char *name, int rows, int columns, const double *values)
{
    static const double none = 0;
    add(arrays, (kmp_named_array){name, rows, columns, values ? values : &none, NULL});
}

int kmp_array_across(const kmp_named_array *array)
{
    return array->columns == KMP_ARRAY_VECTOR ? 1 : array->columns;
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
