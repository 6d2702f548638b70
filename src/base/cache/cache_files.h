/* SPDX-License-Identifier: BSD-3-Clause */
/* A folder of results that can be computed again, each in a file named by its key. Nothing here reports an error: what
 * cannot be read is computed, and what cannot be written is not kept.
 *
 * A file is written under a temporary name and then renamed, so that other processes see all of it or nothing. It has
 * its key and a checksum: a file that is damaged, truncated, of another key, or that others may write does not count.
 * When the folder becomes too large, the files that have not been used for the longest time are deleted. */
#pragma once

#include "base/cache/digest.h"
#include <stdbool.h>

/** Adds what the results of this process depend on in addition to their inputs: the build of Kempe, the builds of the
 * libraries that it has loaded, and the processor's features. False if a build has no identity: nothing can be kept
 * then. */
bool kmp_cache_add_build(kmp_digest *digest);

/** A bound on the bytes of all files in a folder. */
enum { KMP_CACHE_BYTES = 256 << 20 };

typedef struct kmp_cache_key {
    unsigned char digest[KMP_DIGEST_SIZE];
} kmp_cache_key;

/** A file's content; kmp_free(file.whole) ends it. */
typedef struct kmp_cached {
    unsigned char *whole; /* NULL: there is none */
    const unsigned char *bytes;
    size_t size;
} kmp_cached;

kmp_cached kmp_cache_read(const char *folder, const kmp_cache_key *key);

/** Makes the folder where it is missing. Nothing is written if one content exceeds `most` bytes. */
void kmp_cache_write(const char *folder, const kmp_cache_key *key, const void *bytes, size_t size, uint64_t most);
