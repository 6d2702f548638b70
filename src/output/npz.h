/* SPDX-License-Identifier: BSD-3-Clause */
/* Arrays in NumPy's format, several in one .npz: a zip (libzip) of arrays in format 1.0 (numpy.lib.format). Equal
 * arrays give equal bytes. */
#ifndef KMP_OUTPUT_NPZ_H
#define KMP_OUTPUT_NPZ_H

#include "base/context.h"

enum { KMP_NPZ_MOST = 40, KMP_NPZ_VECTOR = -1 };

/** The bytes of one .npy. */
typedef struct kmp_npy {
    const char *name;
    char *bytes;
    size_t head, size;
} kmp_npy;

/** Running out of memory, or of places, is sticky and reported by kmp_npz_write. */
typedef struct kmp_npz {
    int count;
    bool failed;
    kmp_npy array[KMP_NPZ_MOST];
} kmp_npz;

/** Each adds an array; `name` (a literal) without ".npy". Words are fixed-width text of 32-bit characters; characters
 * beyond ASCII become '?'. */
void kmp_npz_words(kmp_npz *npz, const char *name, int count, char *const *word);

/** A matrix that is column-major here and rows x columns there; columns KMP_NPZ_VECTOR: a vector. */
void kmp_npz_matrix(kmp_npz *npz, const char *name, int rows, int columns, const double *values);

/** Adds an array that kmp_npy_put fills, zero before; NULL when there is no memory. */
kmp_npy *kmp_npz_values(kmp_npz *npz, const char *name, int rows, int columns);
void kmp_npy_put(kmp_npy *array, size_t index, double x);

/** Writes whole or not at all. KEMPE_E_IO with the reason. */
kempe_status kmp_npz_write(kempe_context *context, kmp_npz *npz, const char *path);
void kmp_npz_free(kmp_npz *npz);

#endif
