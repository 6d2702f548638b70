/* SPDX-License-Identifier: BSD-3-Clause */
/* Named arrays in one file: .npz for NumPy, .mat for MATLAB and Octave. Equal arrays give equal bytes. */
#pragma once

#include "base/context.h"
#include "base/text.h"
#include <stdint.h>

enum { KMP_ARRAYS_MOST = 40, KMP_ARRAY_VECTOR = -1, KMP_ARRAY_RANK_MOST = 4 };

/** Numbers, or words; owned by the caller up to the writing. */
typedef struct kmp_named_array {
    const char *name;
    int rank, shape[KMP_ARRAY_RANK_MOST];
    bool by_rows;         /* the last index is the fastest one; otherwise the first one */
    const double *values; /* NULL: words */
    char *const *word;    /* a vector */
} kmp_named_array;

/** More arrays than there is room for are sticky, and reported by kmp_arrays_write. */
typedef struct kmp_arrays {
    int count;
    bool failed;
    kmp_named_array array[KMP_ARRAYS_MOST];
} kmp_arrays;

void kmp_arrays_words(kmp_arrays *arrays, const char *name, int count, char *const *word);
/** Values column by column; `columns` KMP_ARRAY_VECTOR: a vector. */
void kmp_arrays_matrix(kmp_arrays *arrays, const char *name, int rows, int columns, const double *values);
/** An array of up to four indices, the last one the fastest; of rank 0: one number. */
void kmp_arrays_tensor(kmp_arrays *arrays, const char *name, int rank, const int *shape, const double *values);

/** Writes whole or not at all, in the format of the path's ending. KEMPE_E_ARGUMENT: another ending. KEMPE_E_IO. */
kempe_status kmp_arrays_write(kempe_context *context, const kmp_arrays *arrays, const char *path);

/** True if an ending such as ".mat" is an ending of files of arrays. */
bool kmp_arrays_ending(const char *ending);

/** Little-endian bytes of an integer or a double on any machine. */
void kmp_put_little(char *to, uint64_t bits, int bytes);
void kmp_put_double(char *to, double x);

/** Appends the little-endian bytes of an integer. */
void kmp_put_integer(kmp_text *text, uint64_t value, int bytes);
