/* SPDX-License-Identifier: BSD-3-Clause */
#include "generate/shared_tables.h"
#include "generate/blocks/block_parts.h"
#include "symbolic/table_function.h"

bool kmp_code_tables_list(kmp_code_source *source)
{
    const kmp_program *p;
    int most = 0;
    for (int r = 0; r < source->count; r++)
        for (int i = 0; (p = kmp_code_next_program(&source->routines[r], &i));)
            most += p->table_count;
    source->tables = KMP_ARENA_NEW(&source->arena, const kmp_table *, most);
    source->table_count = 0;
    for (int r = 0; source->tables && r < source->count; r++)
        for (int i = 0; (p = kmp_code_next_program(&source->routines[r], &i));)
            for (int k = 0; k < p->table_count; k++)
                if (kmp_code_table_number(source, p->table[k]) < 0)
                    source->tables[source->table_count++] = p->table[k];
    return source->tables;
}

bool kmp_code_has_table(const kmp_code_routine *routine, const kmp_table *table)
{
    const kmp_program *p;
    bool found = false;
    for (int i = 0; (p = kmp_code_next_program(routine, &i));)
        for (int k = 0; k < p->table_count; k++)
            found = found || kmp_table_equal(p->table[k], table);
    return found;
}

int kmp_code_table_number(const kmp_code_source *source, const kmp_table *table)
{
    for (int k = 0; k < source->table_count; k++)
        if (kmp_table_equal(source->tables[k], table))
            return k;
    return -1;
}
