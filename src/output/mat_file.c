/* SPDX-License-Identifier: BSD-3-Clause */
/* Arrays in MATLAB's level 5 format, as MATLAB, Octave, SciPy and matio read it (MAT-File Format, The MathWorks,
 * chapter 1): elements of a type, a number of bytes, and the data filled up to eight bytes. Words are a cell array of
 * texts. A writer of ours, since matio puts the date into the file: equal results would have unequal bytes. */
#include "output/mat_file.h"
#include "base/file.h"
#include "output/named_arrays.h"
#include <string.h>

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

/* An array up to its data. */
static size_t begin_array(kmp_text *text, int class, const char *name, int rows, int columns)
{
    size_t array = begin(text, MATRIX), part = begin(text, UINT32);
    kmp_put_integer(text, (uint64_t) class, 8);
    end(text, part);
    part = begin(text, INT32);
    kmp_put_integer(text, (uint64_t)rows, 4);
    kmp_put_integer(text, (uint64_t)columns, 4);
    end(text, part);
    part = begin(text, INT8);
    kmp_text_append(text, name, strlen(name));
    end(text, part);
    return array;
}

/* Characters beyond ASCII become '?', as in .npz. */
static void put_word(kmp_text *text, const char *word)
{
    size_t array = begin_array(text, TEXT, "", *word != '\0', (int)strlen(word)), data = begin(text, UINT16);
    for (; *word; word++)
        kmp_put_integer(text, (unsigned char)*word < 128 ? (unsigned char)*word : '?', 2);
    end(text, data);
    end(text, array);
}

static void put_array(kmp_text *text, const kmp_named_array *a)
{
    size_t array = begin_array(text, a->values ? NUMBERS : CELLS, a->name, a->rows, kmp_array_across(a));
    if (a->values) {
        size_t data = begin(text, DOUBLE), count = (size_t)a->rows * (size_t)kmp_array_across(a);
        for (size_t k = 0; k < count; k++) {
            char little[8];
            kmp_put_double(little, a->values[k]);
            kmp_text_append(text, little, 8);
        }
        end(text, data);
    } else {
        for (int k = 0; k < a->rows; k++)
            put_word(text, a->word[k]);
    }
    end(text, array);
}

kempe_status kmp_mat_write(kempe_context *context, const kmp_arrays *arrays, const char *path)
{
    kmp_text text = {0};
    kmp_text_printf(&text, "%-124s", "MATLAB 5.0 MAT-file, written by Kempe");
    kmp_put_integer(&text, 0x0100, 2);
    kmp_text_put(&text, "IM"); /* little-endian */
    for (int k = 0; k < arrays->count; k++)
        put_array(&text, &arrays->array[k]);
    return kmp_file_write(context, path, &text);
}
