/* SPDX-License-Identifier: BSD-3-Clause */
/* Archives of arrays, .npz of NumPy: a ZIP archive (APPNOTE.TXT 6.3, PKWARE) of files .npy (numpy.lib.format, versions
 * 1 to 3), stored or deflated. Only numbers and words are read: arrays of objects are pickled programs. */
#pragma once

#include "base/arena.h"
#include "base/text.h"

enum { KMP_NPZ_RANK_MOST = 4 };

/** A file of the archive. */
typedef struct kmp_npz_member {
    const char *name; /* of the array, without .npy */
    size_t at, stored, size;
    unsigned method, checksum;
} kmp_npz_member;

typedef struct kmp_npz {
    kmp_arena *arena;
    const unsigned char *bytes;
    size_t length;
    int count;
    kmp_npz_member *members;
} kmp_npz;

/** Numbers, or words where `word` is not NULL; in the order of rows, the last index the fastest. */
typedef struct kmp_npz_array {
    int rank;
    size_t shape[KMP_NPZ_RANK_MOST], count;
    double *value;
    const char **word;
} kmp_npz_array;

/** Reads the directory; names are in the arena, and the bytes are used as long as the archive is. False: `why` says in
 * what way it is none, or the arena has failed. */
bool kmp_npz_open(kmp_arena *arena, const char *bytes, size_t length, kmp_npz *npz, kmp_text *why);

/** True if there is an array of this name. */
bool kmp_npz_has(const kmp_npz *npz, const char *name);

/** An array by its name, in the arena. False: `why` says why it cannot be read, or the arena has failed. */
bool kmp_npz_array_read(const kmp_npz *npz, const char *name, kmp_npz_array *array, kmp_text *why);
