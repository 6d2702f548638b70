/* SPDX-License-Identifier: BSD-3-Clause */
/* Written programs by name: a digest of coordinates, rows and the pattern of charts. A program from the cache is
 * checked in its numbers before it is used, and is written again if it fails. */
#include "constraints/programs/program_records.h"
#include "base/memory.h"
#include "constraints/evaluation/charts.h"
#include "symbolic/program_bytes.h"
#include "symbolic/program_forms.h"
#include <limits.h>
#include <string.h>

kmp_program_cache_name kmp_writer_name(const char *what, const kmp_evaluator *eval, const kmp_partition *part,
                                       const int *order, unsigned options)
{
    kmp_program_cache_name name = {.what = what, .variant = options};
    const int given[] = {part->p, part->r, eval->by_bodies, eval->system->force != NULL};
    kmp_digest digest;
    kmp_digest_begin(&digest);
    kmp_digest_add(&digest, given, sizeof given);
    kmp_digest_add(&digest, part->u, (size_t)part->p * sizeof *part->u);
    kmp_digest_add(&digest, part->v, (size_t)part->r * sizeof *part->v);
    kmp_digest_add(&digest, part->rows, (size_t)part->r * sizeof *part->rows);
    if (order)
        kmp_digest_add(&digest, order, (size_t)part->r * sizeof *order);
    for (int k = 0; k < KMP_CHART_SIZE * eval->system->chart_count; k++) {
        const char chart = eval->chart[k] == 0 ? '0' : eval->chart[k] == 1 ? '1' : 'x';
        kmp_digest_add(&digest, &chart, 1);
    }
    kmp_digest_end(&digest, name.choice.digest);
    return name;
}

/* -- records ------------------------------------------------------------------------------------------- */

static void clear_record(kmp_program_record *record)
{
    kmp_program_free(record->program);
    kmp_free(record->row);
    record->program = NULL;
    record->row = NULL;
}

/* The layouts have the same count. */
static bool copy_record(const kmp_program_record *from, kmp_program_record *to)
{
    to->multipliers = from->multipliers;
    to->row = KMP_NEW(kmp_eliminated, 1 + from->multipliers);
    if (!to->row)
        return false;
    if (from->multipliers > 0)
        memcpy(to->row, from->row, (size_t)from->multipliers * sizeof *to->row);
    if (from->count > 0)
        memcpy(to->layout, from->layout, (size_t)from->count * sizeof *to->layout);
    to->program = kmp_program_share(from->program);
    return true;
}

static void release(void *made)
{
    kmp_program_record *record = made;
    clear_record(record);
    kmp_free(record->layout);
    kmp_free(record);
}

/* Keeps a copy, without which all works as well. */
static void keep_copy(const kempe_system *s, kmp_program_cache_name name, const kmp_program_record *record)
{
    kmp_program_record *kept = KMP_NEW(kmp_program_record, 1);
    int *layout = KMP_NEW(int, 1 + record->count);
    if (kept)
        *kept = (kmp_program_record){.layout = layout, .count = record->count};
    if (kept && layout && copy_record(record, kept)) {
        (void)kmp_program_cache_add(s, name, kept, release);
        return;
    }
    kmp_free(layout);
    kmp_free(kept);
}

/* -- cache --------------------------------------------------------------------------------------------- */

/* True if the numbers belong to this program. */
static bool is_sound(const kempe_system *s, const kmp_program_record *record)
{
    int outputs = record->program ? record->program->outputs[record->program->stages] : 0;
    bool good = record->multipliers <= outputs;
    for (int k = 0; good && k < record->multipliers; k++)
        good =
            record->row[k].row >= 0 && record->row[k].row < s->m && record->row[k].by >= 0 && record->row[k].by < s->m;
    for (int k = 0; good && record->program && k < record->count; k++)
        good = record->layout[k] >= -1 && record->layout[k] <= outputs;
    return good;
}

static bool read_record(kmp_byte_source *b, const kempe_system *s, kmp_program_record *record)
{
    kmp_table_pool pool = {0};
    record->multipliers = kmp_bytes_take_count(b, sizeof *record->row);
    record->row = b->failed ? NULL : KMP_NEW(kmp_eliminated, 1 + record->multipliers);
    if (!record->row)
        return false;
    KMP_BYTES_TAKE(b, record->row, record->multipliers);
    KMP_BYTES_TAKE(b, record->layout, record->count);
    record->program = b->failed ? NULL : kmp_program_get(b, &pool);
    kmp_table_pool_free(&pool);
    if (!b->failed && b->at == b->end && is_sound(s, record))
        return true;
    clear_record(record);
    return false;
}

/* -- both ---------------------------------------------------------------------------------------------- */

bool kmp_writer_recall(const kempe_system *s, kmp_program_cache_name name, kmp_program_record *record)
{
    const kmp_program_record *kept = kmp_program_cache_find(s, name);
    if (kept)
        return copy_record(kept, record);
    kmp_cached file = kmp_program_cache_recall(s, name);
    kmp_byte_source b = kmp_byte_source_of(file.bytes, file.size);
    bool good = file.whole && read_record(&b, s, record);
    kmp_free(file.whole);
    if (good) {
        kmp_program_cache_name_program(s, name, record->program);
        keep_copy(s, name, record);
    }
    return good;
}

void kmp_writer_keep(const kempe_system *s, kmp_program_cache_name name, const kmp_program_record *record)
{
    if (!kmp_program_cache_has_room(s)) /* a motion of many choices fills no folder */
        return;
    if (s->has_key) {
        /* Into the cache. */
        kmp_bytes b = {0};
        kmp_table_pool pool = {0};
        kmp_bytes_put_int(&b, record->multipliers);
        KMP_BYTES_PUT(&b, record->row, record->multipliers);
        KMP_BYTES_PUT(&b, record->layout, record->count);
        kmp_program_put(&b, &pool, record->program);
        kmp_table_pool_free(&pool);
        kmp_program_cache_write(s, name, &b);
        kmp_bytes_free(&b);
    }
    kmp_program_cache_name_program(s, name, record->program);
    keep_copy(s, name, record);
}
