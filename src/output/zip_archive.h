/* SPDX-License-Identifier: BSD-3-Clause */
/* Zip archives without compression (APPNOTE.TXT 6.3, PKWARE), made in memory. One date for all files, so that equal
 * contents give equal bytes. */
#pragma once

#include "base/text.h"
#include <stdint.h>

/** A file in the archive. */
typedef struct kmp_zip_member {
    char *name;
    size_t at, size; /* of its local header; of its data */
    uint32_t checksum;
} kmp_zip_member;

typedef struct kmp_zip {
    kmp_text text; /* data of a file are appended between kmp_zip_begin and kmp_zip_end_member */
    kmp_zip_member *member;
    int count;
    bool wide; /* all sizes with 64 bits, as NumPy writes them; otherwise 32: below 4 GB in all */
} kmp_zip;

/** Begins a file. Failure is reported by the text. */
void kmp_zip_begin(kmp_zip *zip, const char *name);
void kmp_zip_end_member(kmp_zip *zip);
/** A whole file. */
void kmp_zip_add(kmp_zip *zip, const char *name, const char *bytes, size_t size);
/** Ends the archive: its bytes are the text, which the caller takes over; frees all else. */
kmp_text kmp_zip_end(kmp_zip *zip);
