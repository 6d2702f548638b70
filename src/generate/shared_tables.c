/* SPDX-License-Identifier: BSD-3-Clause */
#include "generate/shared_tables.h"
#include "generate/blocks/block_parts.h"
#include "symbolic/table_function.h"

typedef void visit(kmp_code_source *source, const kmp_program *program);

/* All programs, those of the parts of blocks after each routine. */
static void visit_programs(kmp_code_source *source, visit *each)
{
    for (int k = 0; k < source->count; k++) {
        const kmp_code_routine *r = &source->routines[k];
        each(source, r->program);
        for (int b = 0; r->blocks && b < r->program->block_count; b++)
            for (int part = 0; part < KMP_BLOCK_PARTS; part++)
                each(source, r->blocks[b].part[part].program);
    }
}

static void count(kmp_code_source *source, const kmp_program *p)
{
    source->table_count += p ? p->table_count : 0;
}

static void take(kmp_code_source *source, const kmp_program *p)
{
    for (int k = 0; p && k < p->table_count; k++)
        if (kmp_code_table_number(source, p->table[k]) < 0)
            source->tables[source->table_count++] = p->table[k];
}

bool kmp_code_tables_list(kmp_code_source *source)
{
    source->table_count = 0;
    visit_programs(source, count);
    source->tables = KMP_ARENA_NEW(&source->arena, const kmp_table *, source->table_count);
    source->table_count = 0;
    if (source->tables)
        visit_programs(source, take);
    return source->tables;
}

static bool has(const kmp_program *p, const kmp_table *table)
{
    for (int k = 0; p && k < p->table_count; k++)
        if (kmp_table_equal(p->table[k], table))
            return true;
    return false;
}

bool kmp_code_has_table(const kmp_code_routine *routine, const kmp_table *table)
{
    bool found = has(routine->program, table);
    for (int b = 0; routine->blocks && b < routine->program->block_count; b++)
        for (int part = 0; part < KMP_BLOCK_PARTS; part++)
            found = found || has(routine->blocks[b].part[part].program, table);
    return found;
}

int kmp_code_table_number(const kmp_code_source *source, const kmp_table *table)
{
    for (int k = 0; k < source->table_count; k++)
        if (kmp_table_equal(source->tables[k], table))
            return k;
    return -1;
}
