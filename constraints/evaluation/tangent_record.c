/* SPDX-License-Identifier: BSD-3-Clause */
/* Tangent programs in memory and on disk. A program from a file is checked against the sizes of the system before it is
 * used. */
#include "constraints/evaluation/tangent_record.h"
#include "base/memory.h"
#include "constraints/evaluation/tangent.h"
#include "dynamics/program_cache.h"
#include "symbolic/program_bytes.h"
#include "symbolic/program_forms.h"
#include <limits.h>
#include <string.h>

enum { FORCED = 1 << KMP_VALUES };

/* The entries of a user-defined force are among the others. */
static kmp_program_cache_name name_of(const kempe_system *system, unsigned values)
{
    return (kmp_program_cache_name){.what = "tangents", .variant = values | (system->force ? FORCED : 0)};
}

static void name_programs(const kmp_tangents *t, const kempe_system *system, unsigned values)
{
    unsigned variant = name_of(system, values).variant;
    kmp_program_cache_name_program(system, (kmp_program_cache_name){.what = "code of values", .variant = variant},
                                   t->value.program);
    kmp_program_cache_name_program(system, (kmp_program_cache_name){.what = "code of tangents", .variant = variant},
                                   t->tangent.program);
}

/* -- what is kept --------------------------------------------------------------------------------------- */

/* Programs that are shared, and a separate list of entries; no machines. */
static bool copy_programs(const kmp_tangents *from, kmp_tangents *to)
{
    int count = from->start[KMP_TANGENT_BLOCKS];
    kmp_tangent *entry = KMP_NEW(kmp_tangent, count);
    if (!entry)
        return false;
    if (count > 0)
        memcpy(entry, from->entry, (size_t)count * sizeof *entry);
    memcpy(to->at, from->at, sizeof to->at);
    memcpy(to->start, from->start, sizeof to->start);
    to->entry = entry;
    to->first_effort = from->first_effort;
    to->choice = from->choice;
    to->value.program = kmp_program_share(from->value.program);
    to->tangent.program = kmp_program_share(from->tangent.program);
    return true;
}

static void release(void *made)
{
    kmp_tangents_free(made);
    kmp_free(made);
}

/* Keeps a copy, without which all works as well. */
static void keep_copy(const kmp_tangents *t, const kempe_system *system, unsigned values)
{
    kmp_tangents *kept = KMP_NEW(kmp_tangents, 1);
    if (kept && copy_programs(t, kept))
        (void)kmp_program_cache_add(system, name_of(system, values), kept, release);
    else
        kmp_free(kept);
}

void kmp_tangents_keep(const kmp_tangents *t, const kempe_system *system, unsigned values)
{
    if (system->has_key) {
        /* Into the cache. */
        kmp_bytes b = {0};
        kmp_table_pool pool = {0};
        KMP_BYTES_PUT(&b, t->at, KMP_VALUES);
        KMP_BYTES_PUT(&b, t->start, KMP_TANGENT_BLOCKS + 1);
        KMP_BYTES_PUT(&b, t->entry, t->start[KMP_TANGENT_BLOCKS]);
        kmp_bytes_put_int(&b, t->first_effort);
        kmp_bytes_put(&b, &t->choice, sizeof t->choice);
        kmp_program_put(&b, &pool, t->value.program);
        kmp_program_put(&b, &pool, t->tangent.program);
        kmp_table_pool_free(&pool);
        kmp_program_cache_write(system, name_of(system, values), &b);
        kmp_bytes_free(&b);
    }
    name_programs(t, system, values);
    keep_copy(t, system, values);
}

/* -- reading ---------------------------------------------------------------------------------------------- */

/* True if the numbers belong to these programs. */
static bool is_sound(const kmp_tangents *t)
{
    int values = 2 * t->n + 3 * t->m + 1;
    bool good = t->start[0] == 0;
    for (int v = 0; v < KMP_VALUES; v++)
        good = good && t->at[v] >= -1 && t->at[v] <= values;
    for (int block = 0; good && block < KMP_TANGENT_BLOCKS; block++)
        for (int k = t->start[block]; good && k < t->start[block + 1]; k++) {
            const kmp_tangent *e = &t->entry[k];
            int most = t->n > t->m ? t->n : t->m, sources = t->tangent.program->outputs[t->tangent.program->stages];
            int forced = t->forced ? 2 * t->n * (t->n + 1) : 0;
            good = e->block == block && e->row >= 0 && e->row < (most > 0 ? most : 1) && e->col >= 0 && e->col < most &&
                   e->source >= 0 && e->source < sources + forced;
        }
    return good;
}

/* The entries by block, in order of their blocks. */
static bool take_entries(kmp_byte_source *s, kmp_tangents *t)
{
    KMP_BYTES_TAKE(s, t->at, KMP_VALUES);
    KMP_BYTES_TAKE(s, t->start, KMP_TANGENT_BLOCKS + 1);
    int count = t->start[KMP_TANGENT_BLOCKS];
    bool good = !s->failed && count >= 0 && (size_t)count <= (size_t)(s->end - s->at) / sizeof *t->entry;
    for (int block = 0; block < KMP_TANGENT_BLOCKS; block++)
        good = good && t->start[block] >= 0 && t->start[block] <= t->start[block + 1];
    t->entry = good ? KMP_NEW(kmp_tangent, count) : NULL;
    if (t->entry)
        KMP_BYTES_TAKE(s, t->entry, count);
    return t->entry;
}

bool kmp_tangents_recall(kmp_tangents *tangents, const kempe_system *system, unsigned values)
{
    const kmp_tangents *kept = kmp_program_cache_find(system, name_of(system, values));
    if (kept)
        return copy_programs(kept, tangents);
    kmp_cached file = kmp_program_cache_recall(system, name_of(system, values));
    kmp_byte_source s = kmp_byte_source_of(file.bytes, file.size);
    kmp_tangents t = *tangents;
    bool good = file.whole && take_entries(&s, &t);
    if (file.whole) {
        kmp_table_pool pool = {0};
        t.first_effort = kmp_bytes_take_int(&s, 0, INT_MAX);
        kmp_bytes_take(&s, &t.choice, sizeof t.choice);
        t.value.program = good ? kmp_program_get(&s, &pool) : NULL;
        t.tangent.program = good ? kmp_program_get(&s, &pool) : NULL;
        kmp_table_pool_free(&pool);
        good = good && !s.failed && s.at == s.end && (t.value.program || !(values & KMP_TANGENTS_WITH_VALUES)) &&
               t.tangent.program && is_sound(&t);
    }
    kmp_free(file.whole);
    if (good) {
        name_programs(&t, system, values);
        keep_copy(&t, system, values);
        *tangents = t;
    } else if (file.whole) {
        kmp_tangents_free(&t);
    }
    return good;
}
