/* SPDX-License-Identifier: BSD-3-Clause */
/* A program that was written as bytes and read again. */
#ifndef KEMPE_TESTS_READ_AGAIN_H
#define KEMPE_TESTS_READ_AGAIN_H

#include "symbolic/program_bytes.h"
#include "testing.h"

static inline kmp_program *read_again(const kmp_program *p)
{
    kmp_bytes bytes = {0};
    kmp_table_pool written = {0}, read = {0};
    kmp_program_put(&bytes, &written, p);
    kmp_byte_source source = kmp_byte_source_of(bytes.at, bytes.size);
    kmp_program *again = kmp_program_get(&source, &read);
    CHECK(again && !source.failed && source.at == source.end);
    kmp_table_pool_free(&written);
    kmp_table_pool_free(&read);
    kmp_bytes_free(&bytes);
    return again;
}

#endif
