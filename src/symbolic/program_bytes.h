/* SPDX-License-Identifier: BSD-3-Clause */
/* Programs as bytes, for caches: equal to the bit when they are read again. Labels are left out. */
#pragma once

#include "base/cache/bytes.h"
#include "symbolic/program.h"

/** Tables that the programs of one sequence of bytes share: written once each. Zero initially. */
typedef struct kmp_table_pool {
    struct kmp_table **table;
    int count;
} kmp_table_pool;

void kmp_table_pool_free(kmp_table_pool *pool);

/** NULL, no program, is kept. The bytes fail where there is no memory. */
void kmp_program_put(kmp_bytes *bytes, kmp_table_pool *pool, const kmp_program *p);

/** The program, NULL where none was written. NULL and a failed source: the bytes are not a program, or there is no
 * memory. Operands, tables and blocks of what is returned exist. */
kmp_program *kmp_program_get(kmp_byte_source *source, kmp_table_pool *pool);
