/* SPDX-License-Identifier: BSD-3-Clause */
/* Digests of bytes: SHA-256 (FIPS 180-4) identifies inputs, a fast sum detects damage. */
#pragma once

#include <stddef.h>
#include <stdint.h>

enum { KMP_DIGEST_SIZE = 32 };

typedef struct kmp_digest {
    uint32_t state[8];
    uint64_t length;
    unsigned char block[64];
} kmp_digest;

void kmp_digest_begin(kmp_digest *digest);
void kmp_digest_add(kmp_digest *digest, const void *bytes, size_t size);
/** Adds the size, then the bytes: parts that follow each other cannot be confused. */
void kmp_digest_add_part(kmp_digest *digest, const void *bytes, size_t size);
/** kmp_digest_add_part of a string. NULL differs from "". */
void kmp_digest_add_text(kmp_digest *digest, const char *text);
void kmp_digest_end(kmp_digest *digest, unsigned char out[KMP_DIGEST_SIZE]);

/** A sum of 64 bits that changes with every single damaged byte, and with all but 2^-64 of other damage. */
uint64_t kmp_checksum(const void *bytes, size_t size);
