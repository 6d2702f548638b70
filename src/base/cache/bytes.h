/* SPDX-License-Identifier: BSD-3-Clause */
/* Values as bytes, in the machine's own order: for files that the same build reads again. */
#pragma once

#include "base/arena.h"
#include <stddef.h>
#include <stdint.h>

/** Bytes that grow; zero initially. `failed` is sticky: no memory, or something that cannot be written. */
typedef struct kmp_bytes {
    unsigned char *at;
    size_t size, room;
    bool failed;
} kmp_bytes;

void kmp_bytes_free(kmp_bytes *bytes);
void kmp_bytes_put(kmp_bytes *bytes, const void *from, size_t size);
void kmp_bytes_put_int(kmp_bytes *bytes, int64_t value);
/** The text's length and the text; NULL is kept. */
void kmp_bytes_put_text(kmp_bytes *bytes, const char *text);

#define KMP_BYTES_PUT(bytes, array, count) kmp_bytes_put((bytes), (array), (size_t)(count) * sizeof *(array))

/** A place in bytes that are read. `failed` is sticky: the bytes have ended, or a value is out of its range. */
typedef struct kmp_byte_source {
    const unsigned char *at, *end;
    bool failed;
} kmp_byte_source;

kmp_byte_source kmp_byte_source_of(const void *bytes, size_t size);

/** Zeros after a failure. */
void kmp_bytes_take(kmp_byte_source *source, void *to, size_t size);
/** A number within [low, high]; otherwise `low`, and the source has failed. */
int kmp_bytes_take_int(kmp_byte_source *source, int low, int high);
/** A count of items of `size` bytes each that follow: never more than there are. */
int kmp_bytes_take_count(kmp_byte_source *source, size_t size);
/** A text in the arena; NULL where NULL was written, or after a failure. */
char *kmp_bytes_take_text(kmp_byte_source *source, kmp_arena *arena);

#define KMP_BYTES_TAKE(source, array, count) kmp_bytes_take((source), (array), (size_t)(count) * sizeof *(array))
