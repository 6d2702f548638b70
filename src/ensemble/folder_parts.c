/* SPDX-License-Identifier: BSD-3-Clause */
/* The parts of a result folder: read, checked, and put together. */
#include "ensemble/folder_parts.h"
#include "base/file.h"
#include "ensemble/lasting_files.h"
#include "ensemble/manifest.h"
#include "ensemble/result_folder.h"
#include "ensemble/sampling/model_instances.h"
#include "ensemble/sampling/parquet_reader.h"
#include "ensemble/sampling/values.h"
#include "ensemble/statistics/statistics.h"
#include "model/data/model.h"
#include "output/result_table.h"
#include <stdio.h>
#include <string.h>

enum { GROUP_ROWS = 1 << 16, MOST_NAMED = 8 };

/* -- one part ---------------------------------------------------------------------------------------- */

/* Why a part does not belong to the folder; NULL: it is. */
static const char *fault_of(const kempe_folder *f, int part, bool history, const kmp_parquet_file *file)
{
    char number[16];
    (void)snprintf(number, sizeof number, "%d", part);
    if (!file->sum_holds)
        return "it is damaged: the sum of its bytes is wrong";
    if (strcmp(kmp_parquet_value(file, "kempe.run"), f->hash) != 0)
        return "it belongs to another run";
    if (strcmp(kmp_parquet_value(file, "kempe.part"), number) != 0)
        return "it is another part";
    if (!history && file->rows != kmp_folder_part_size(f, part))
        return "it has another number of rows";
    return NULL;
}

/* Reads a part, or its histories. KEMPE_E_INPUT: it is damaged, or not that part; KEMPE_E_IO. */
static kempe_status read_file(const kempe_folder *f, int part, bool history, kmp_parquet_file *file)
{
    kmp_text path = {0};
    (history ? kmp_folder_put_history : kmp_folder_put_part)(&path, f->path, part);
    kempe_status status = kmp_made(f->context, !path.failed);
    if (status == KEMPE_OK)
        status = kmp_parquet_read(f->context, path.s, file);
    const char *fault = status == KEMPE_OK ? fault_of(f, part, history, file) : NULL;
    if (fault) {
        status =
            kmp_complain(f->context, path.s, 0, 0, "%s; remove it, and the run with --resume makes it again", fault);
        kmp_parquet_file_free(file);
    }
    kmp_text_free(&path);
    return status;
}

static kempe_status read_part(const kempe_folder *f, int part, kmp_parquet_file *file)
{
    return read_file(f, part, false, file);
}

/* An empty table with the columns of a part; `chosen` NULL: all of them. */
static kempe_table *table_of(kempe_context *context, const char *name, const kmp_parquet_file *file, const bool *chosen)
{
    kempe_table *table = kmp_tabulate(context, name);
    for (int c = 0; c < file->column_count; c++) {
        const kmp_parquet_column *column = &file->column[c];
        if (chosen && !chosen[c])
            continue;
        kmp_tabulate_column(table, column->number ? column->unit : NULL, "%s", column->name);
    }
    kmp_tabulate_apart(table);
    return table;
}

/* The same in SI, for statistics, which texts and objects show in their own units. */
static kempe_table *table_in_si(kempe_context *context, const kmp_parquet_file *file, const bool *chosen)
{
    const kmp_shown_in shown = kmp_context_show_in(context, (kmp_shown_in){0});
    kempe_table *table = table_of(context, "instances", file, chosen);
    (void)kmp_context_show_in(context, shown);
    return table;
}

static void add_rows(kempe_table *table, const kmp_parquet_file *file, const bool *chosen)
{
    for (int row = 0; row < file->rows; row++) {
        kmp_tabulate_row(table);
        for (int c = 0; c < file->column_count; c++)
            if (chosen && !chosen[c])
                continue;
            else if (file->column[c].number)
                kmp_tabulate_number(table, file->column[c].number[row]);
            else
                kmp_tabulate_cells(table, "%s", file->column[c].word[row]);
    }
}

kempe_status kempe_folder_part(const kempe_folder *f, int part, kempe_table **table)
{
    KMP_WANTED(NULL, f, "folder");
    KMP_WANTED(f->context, table, "table");
    kmp_parquet_file file = {0};
    kmp_context_clear(f->context);
    if (part < 0 || part >= f->parts)
        return kmp_fail(f->context, KEMPE_E_ARGUMENT, "there is no part %d: there are %d, from 0 on", part, f->parts);
    KMP_TRY(read_part(f, part, &file));
    kempe_table *made = table_of(f->context, "instances", &file, NULL);
    add_rows(made, &file, NULL);
    kmp_parquet_file_free(&file);
    return kmp_tabulate_finish(f->context, made, table);
}

/* -- one instance ------------------------------------------------------------------------------------ */

/* The values of an instance as its part has them, under the names of their columns. */
static kempe_status read_values(const kempe_folder *f, int instance, int count, const char *const *names,
                                double *values)
{
    kmp_parquet_file file = {0};
    int part = instance / f->chunk, row = instance % f->chunk;
    if (!kmp_folder_has_part(f, part))
        return kmp_fail(f->context, KEMPE_E_FAILED,
                        "%s: part %d with the values of instance %d is missing; the run with --resume makes it",
                        f->path, part, instance + 1);
    KMP_TRY(read_part(f, part, &file));
    bool all = file.column_count >= count;
    for (int k = 0; k < count && all; k++) { /* the columns of values are the first ones */
        all = file.column[k].number && strcmp(kmp_value_name(file.column[k].name), names[k]) == 0;
        values[k] = all ? file.column[k].number[row] : 0;
    }
    kmp_parquet_file_free(&file);
    return all ? KEMPE_OK : kmp_complain(f->context, f->path, 0, 0, "part %d lacks the columns of the values", part);
}

static kempe_status instance_of(const kempe_folder *f, const kempe_model *model, int instance, kempe_model **made)
{
    kmp_arena arena = {0};
    char **names = NULL;
    /* The names of the columns of values, an array of words in one member of the manifest. */
    kmp_text list = {0};
    int count = kmp_manifest_text(f->manifest, "columns", &list) ? kmp_text_words(&arena, list.s, &names) : 0;
    arena.failed = arena.failed || list.failed;
    kmp_text_free(&list);
    double *values = KMP_ARENA_NEW(&arena, double, count);
    kempe_status status = kmp_made(f->context, !arena.failed);
    if (status == KEMPE_OK)
        status = read_values(f, instance, count, (const char *const *)names, values);
    if (status == KEMPE_OK)
        status = kmp_model_instance(model, count, (const char *const *)names, values, made);
    kmp_arena_free(&arena);
    return status;
}

kempe_status kmp_folder_check_model(const kempe_folder *f, const kempe_model *model)
{
    kmp_text there = {0};
    char hash[KMP_HASH_SIZE + 1];
    KMP_TRY(kmp_manifest_hash_model(model, hash));
    bool same = kmp_manifest_text(f->manifest, "hash_model", &there) && strcmp(there.s, hash) == 0;
    bool memory = !there.failed;
    kmp_text_free(&there);
    KMP_TRY(kmp_made(f->context, memory));
    if (!same)
        return kmp_complain(
            f->context, f->path, 0, 0,
            "the results belong to another model than '%s' (its file, a file that it includes, --set or --at)",
            model->source.file);
    return KEMPE_OK;
}

kempe_status kempe_folder_model(const kempe_folder *f, const kempe_model *model, int instance, kempe_model **made)
{
    KMP_WANTED(NULL, f, "folder");
    KMP_WANTED(f->context, model, "model");
    KMP_WANTED(f->context, made, "made");
    kmp_context_clear(f->context);
    if (instance < 0 || instance >= f->instances)
        return kmp_fail(f->context, KEMPE_E_ARGUMENT, "instance %d does not exist: the ensemble has %d", instance + 1,
                        f->instances);
    KMP_TRY(kmp_folder_check_model(f, model));
    return instance_of(f, model, instance, made);
}

static bool same_columns(const kempe_table *table, const kmp_parquet_file *file)
{
    bool same = kempe_table_column_count(table) == file->column_count;
    for (int c = 0; c < file->column_count && same; c++)
        same = strcmp(kempe_table_column_name(table, c), file->column[c].name) == 0;
    return same;
}

/* -- statistics --------------------------------------------------------------------------------------- */

static kempe_status begin_statistics(kempe_folder *f, const kmp_parquet_file *file)
{
    f->shape = table_of(f->context, "instances", file, NULL);
    KMP_TRY(kmp_tabulate_check(f->context, f->shape));
    f->chosen = KMP_ARENA_NEW(&f->arena, bool, file->column_count);
    KMP_TRY(kmp_made(f->context, !f->arena.failed));
    if (!kmp_statistics_choose(f->shape, f->chosen))
        return KEMPE_OK;
    f->measured = table_in_si(f->context, file, f->chosen);
    return kmp_tabulate_check(f->context, f->measured);
}

/* Adds the columns of a part that statistics read. */
static kempe_status measure(kempe_folder *f, int part, const kmp_parquet_file *file)
{
    if (!f->shape)
        KMP_TRY(begin_statistics(f, file));
    if (!same_columns(f->shape, file))
        return kmp_complain(f->context, f->path, 0, 0, "part %d has other columns than the first part", part);
    if (!f->measured)
        return KEMPE_OK; /* without quantities */
    add_rows(f->measured, file, f->chosen);
    return kmp_tabulate_check(f->context, f->measured);
}

/* Of a complete folder whose parts were all taken. */
static kempe_status end_statistics(kempe_folder *f)
{
    if (f->measured && f->rows.ok > 0 && f->damaged == 0)
        KMP_TRY(kmp_statistics_of_folder(f->measured, f->path, &f->statistics));
    kempe_table_free(f->measured);
    f->measured = NULL;
    return KEMPE_OK;
}

/* -- all parts --------------------------------------------------------------------------------------- */

static bool has_reasons(const kmp_parquet_file *file)
{
    const int reason = kmp_parquet_find(file, "reason");
    for (int row = 0; reason >= 0 && file->column[reason].word && row < file->rows; row++)
        if (*file->column[reason].word[row])
            return true;
    return false;
}

static void count_rows(kempe_folder *f, int part, const kmp_parquet_file *file)
{
    int status = kmp_parquet_find(file, "status"), verdict = kmp_parquet_find(file, "verdict");
    for (int row = 0; status >= 0 && file->column[status].word && row < file->rows; row++) {
        kmp_instances_count(&f->rows, file->column[status].word[row]);
        f->rows.repeated += verdict >= 0 && file->column[verdict].word && *file->column[verdict].word[row] != '\0';
    }
    if (!has_reasons(file))
        return;
    kempe_table *table = table_in_si(f->context, file, NULL);
    add_rows(table, file, NULL);
    if (kmp_tabulate_check(f->context, table) == KEMPE_OK)
        kmp_instance_causes_add(&f->causes, table, (long)part * f->chunk);
    else
        f->causes.arena.failed = true;
    kempe_table_free(table);
}

static void begin_check(kempe_folder *f)
{
    f->checked = true;
    f->damaged = 0;
    f->rows = (kmp_instance_sums){0};
    kmp_folder_clear(f);
    kmp_folder_count(f);
}

kempe_status kmp_folder_judge(const kempe_folder *f, kempe_status status)
{
    const kmp_instance_sums *rows = &f->rows;
    if (status == KEMPE_OK && rows->failed > 0 && rows->ok == 0)
        status = kmp_fail(f->context, KEMPE_E_FAILED, "no instance reached its end: %ld; their rows have the reasons",
                          rows->stopped + rows->failed);
    if (status == KEMPE_OK && rows->stopped + rows->failed + rows->distrusted > 0)
        kmp_doubt(f->context,
                  "instances that did not reach their end: %ld, that are not trustworthy: %ld; their rows have the "
                  "reasons",
                  rows->stopped + rows->failed, rows->distrusted);
    return kmp_context_verdict(f->context, status);
}

/* The parts that are missing, in a sentence; KEMPE_OK: there are none. */
static kempe_status check_complete(const kempe_folder *f)
{
    kmp_text sentence = {0};
    int missing = f->parts - f->whole, named = 0;
    if (missing == 0)
        return KEMPE_OK;
    kmp_text_printf(&sentence, "%s: %d of %d parts %s missing:", f->path, missing, f->parts,
                    missing == 1 ? "is" : "are");
    for (int k = 0; k < f->parts && named < MOST_NAMED; k++)
        if (!kmp_folder_has_part(f, k))
            kmp_text_printf(&sentence, "%s %d", named++ > 0 ? "," : "", k);
    kmp_text_printf(&sentence, "%s; the run with --resume makes %s", missing > named ? ", .." : "",
                    missing == 1 ? "it" : "them");
    return kmp_fail_text(f->context, KEMPE_E_FAILED, &sentence);
}

static kempe_status check_history(const kempe_folder *f, int part)
{
    kmp_parquet_file file = {0};
    kempe_status status = kmp_folder_wants_history(f, part) ? read_file(f, part, true, &file) : KEMPE_OK;
    kmp_parquet_file_free(&file);
    return status;
}

kempe_status kempe_folder_check(kempe_folder *f)
{
    KMP_WANTED(NULL, f, "folder");
    kempe_status status = KEMPE_OK;
    kmp_context_begin(f->context);
    begin_check(f);
    for (int k = 0; k < f->parts && status == KEMPE_OK; k++) {
        kmp_parquet_file file = {0};
        if (kmp_interrupted(f->context))
            return KEMPE_STOPPED;
        if (!kmp_folder_has_part(f, k))
            continue;
        status = read_part(f, k, &file);
        if (status == KEMPE_OK)
            status = measure(f, k, &file);
        if (status == KEMPE_OK)
            count_rows(f, k, &file);
        if (status == KEMPE_OK)
            status = check_history(f, k);
        f->damaged += status == KEMPE_E_INPUT || status == KEMPE_E_IO;
        status = status == KEMPE_E_MEMORY ? status : KEMPE_OK;
        kmp_parquet_file_free(&file);
        kmp_progress(f->context, KMP_PROGRESS_STUDY, k + 1, f->parts, "parts");
    }
    KMP_TRY(status);
    status = check_complete(f);
    if (status == KEMPE_OK && f->damaged == 0)
        return kmp_folder_judge(f, end_statistics(f));
    return f->damaged > 0 ? KEMPE_E_FAILED : status;
}

/* -- one table --------------------------------------------------------------------------------------- */

/* Rows of parts on their way into a file: written group by group in a format that allows it, else all at once. Without
 * a file they are one table. */
typedef struct gathering {
    kempe_folder *folder;
    kmp_file_stream *stream;     /* NULL: all at once */
    bool is_csv, units, history; /* history: of the histories of parts */
    long rows;                   /* written */
    kmp_parquet_groups groups;
    kempe_table *shape; /* columns without rows */
    kempe_table *table; /* rows that wait; NULL: none */
} gathering;

/* Writes the rows that wait. */
static kempe_status flush(gathering *g)
{
    kmp_text text = {0};
    bool first = g->rows == 0;
    if (g->is_csv) {
        kmp_table_put_csv(&text, g->table, first);
    } else {
        if (first)
            kmp_parquet_begin(&text);
        kmp_parquet_add(&text, &g->groups, g->table);
        g->groups.before += text.length;
    }
    g->rows += kempe_table_row_count(g->table);
    kempe_table_free(g->table);
    g->table = NULL;
    return kmp_file_stream_put(g->stream, &text);
}

static kempe_table *begin_table(const gathering *g, const kmp_parquet_file *file)
{
    kempe_table *table = table_of(g->folder->context, g->history ? "history" : "instances", file, NULL);
    if (g->units)
        kempe_table_name_units(table);
    return table;
}

/* Adds the rows of a part to the rows that wait. */
static kempe_status take_rows(gathering *g, int part, const kmp_parquet_file *file)
{
    kempe_context *context = g->folder->context;
    if (!g->shape)
        g->shape = begin_table(g, file);
    KMP_TRY(kmp_tabulate_check(context, g->shape));
    if (!g->history)
        KMP_TRY(measure(g->folder, part, file));
    else if (!same_columns(g->shape, file))
        return kmp_complain(context, g->folder->path, 0, 0, "the histories of part %d have other columns", part);
    if (!g->table)
        g->table = begin_table(g, file);
    add_rows(g->table, file, NULL);
    return kmp_tabulate_check(context, g->table);
}

static kempe_status gather_part(gathering *g, int part)
{
    kempe_folder *f = g->folder;
    kmp_parquet_file file = {0};
    if (g->history && !kmp_folder_wants_history(f, part))
        return KEMPE_OK;
    KMP_TRY(read_file(f, part, g->history, &file));
    if (!g->history)
        count_rows(f, part, &file);
    bool empty = g->history && file.rows == 0; /* no instance could start: without columns */
    kempe_status status = empty ? KEMPE_OK : take_rows(g, part, &file);
    kmp_parquet_file_free(&file);
    if (status == KEMPE_OK && g->stream && g->table && kempe_table_row_count(g->table) >= GROUP_ROWS)
        status = flush(g);
    kmp_progress(f->context, KMP_PROGRESS_STUDY, part + 1, f->parts, "parts");
    return status;
}

static kempe_status finish(gathering *g, const char *path)
{
    kmp_text text = {0};
    if (!g->shape)
        return kmp_fail(g->folder->context, KEMPE_E_FAILED,
                        "%s has no rows of histories: no chosen instance could start", g->folder->path);
    if (!g->stream)
        return kempe_table_write(g->table, path);
    if (g->table)
        KMP_TRY(flush(g));
    if (!g->is_csv) {
        kmp_parquet_end(&text, &g->groups, g->shape);
        KMP_TRY(kmp_file_stream_put(g->stream, &text));
    }
    kmp_file_stream *stream = g->stream;
    g->stream = NULL;
    return kmp_file_stream_end(stream);
}

/* path NULL: no file. */
static kempe_status gather(gathering *g, const char *path)
{
    kempe_folder *f = g->folder;
    if (g->history)
        kmp_folder_count(f);
    else
        begin_check(f);
    KMP_TRY(check_complete(f));
    if (f->parts == 0)
        return kmp_fail(f->context, KEMPE_E_FAILED, "%s has no instances", f->path);
    g->is_csv = path && (strcmp(kmp_file_ending(path), ".csv") == 0 || !*kmp_file_ending(path));
    if (g->is_csv || (path && strcmp(kmp_file_ending(path), ".parquet") == 0))
        KMP_TRY(kmp_file_stream_new(f->context, path, &g->stream));
    for (int k = 0; k < f->parts; k++) {
        if (kmp_interrupted(f->context))
            return KEMPE_STOPPED;
        KMP_TRY(gather_part(g, k));
    }
    if (!g->history)
        KMP_TRY(end_statistics(f));
    return path ? finish(g, path) : KEMPE_OK;
}

/* Into a file, or into a table. */
static kempe_status gather_all(gathering *g, const char *path, kempe_table **table)
{
    kmp_context_begin(g->folder->context);
    kempe_status status = gather(g, path);
    if (status == KEMPE_OK && table) {
        *table = g->table;
        g->table = NULL;
    }
    kmp_file_stream_free(g->stream);
    kmp_parquet_groups_free(&g->groups);
    kempe_table_free(g->table);
    kempe_table_free(g->shape);
    return status;
}

kempe_status kmp_folder_table(kempe_folder *folder, kempe_table **table)
{
    return gather_all(&(gathering){.folder = folder}, NULL, table);
}

kempe_status kempe_folder_write(kempe_folder *folder, const char *path, int units)
{
    KMP_WANTED_BOTH(folder, path);
    return kmp_folder_judge(folder, gather_all(&(gathering){.folder = folder, .units = units != 0}, path, NULL));
}

kempe_status kempe_folder_write_history(kempe_folder *folder, const char *path, int units)
{
    KMP_WANTED_BOTH(folder, path);
    kmp_context_clear(folder->context);
    if (!folder->history)
        return kmp_fail(folder->context, KEMPE_E_ARGUMENT,
                        "%s has no histories: its run had no --history with chosen instances", folder->path);
    return gather_all(&(gathering){.folder = folder, .units = units != 0, .history = true}, path, NULL);
}
