/* SPDX-License-Identifier: BSD-3-Clause */
/* Result folders: opened, counted and described. */
#include "ensemble/result_folder.h"
#include "base/arena.h"
#include "base/context.h"
#include "base/json.h"
#include "base/memory.h"
#include "base/text.h"
#include "ensemble/histories.h"
#include "ensemble/manifest.h"
#include "ensemble/statistics/statistics.h"
#include "model/data/run_settings.h"
#include "output/print.h"
#include "output/start_balance.h"
#include "platform/platform.h"
#include <kempe/kempe.h>
#include <limits.h>
#include <math.h>
#include <stdbool.h>
#include <stdio.h>
#include <string.h>

#define PART    "%s/part-%06d.parquet"
#define HISTORY "%s/history/part-%06d.parquet"

enum { LEAST_CHUNK = 256, MOST_CHUNK = 4096, USUAL_PARTS = 64, LABEL = 10 };

int kmp_folder_chunk(int instances)
{
    int chunk = (instances / USUAL_PARTS + 7) / 8 * 8; /* lanes that are full */
    return chunk < LEAST_CHUNK ? LEAST_CHUNK : chunk > MOST_CHUNK ? MOST_CHUNK : chunk;
}

void kmp_folder_put_part(kmp_text *path, const char *folder, int part)
{
    kmp_text_printf(path, PART, folder, part);
}

void kmp_folder_put_history(kmp_text *path, const char *folder, int part)
{
    kmp_text_printf(path, HISTORY, folder, part);
}

void kmp_folder_put_manifest(kmp_text *path, const char *folder)
{
    kmp_text_printf(path, "%s/manifest.json", folder);
}

/* True if a file is there; length: the name of its path, which was written to a buffer of KMP_PATH_MOST. */
static bool has_file(const char *path, int length)
{
    kmp_path_state about;
    return length > 0 && length < KMP_PATH_MOST && kmp_path_look(path, &about) && about.kind == KMP_PATH_FILE &&
           about.size > 0;
}

bool kmp_folder_wants_history(const kempe_folder *f, int part)
{
    return kmp_instance_ranges_meet(&f->ranges, part * f->chunk, kmp_folder_part_size(f, part));
}

bool kmp_folder_has_part(const kempe_folder *f, int part)
{
    char path[KMP_PATH_MOST];
    if (!has_file(path, snprintf(path, sizeof path, PART, f->path, part)))
        return false;
    return !kmp_folder_wants_history(f, part) || has_file(path, snprintf(path, sizeof path, HISTORY, f->path, part));
}

void kmp_folder_count(kempe_folder *f)
{
    f->whole = 0;
    for (int k = 0; k < f->parts; k++)
        f->whole += kmp_folder_has_part(f, k);
}

int kmp_folder_part_size(const kempe_folder *f, int part)
{
    int left = f->instances - part * f->chunk;
    return left < f->chunk ? left : f->chunk;
}

/* -- opening ----------------------------------------------------------------------------------------- */

static const char *keep_text(kempe_folder *f, const char *key)
{
    kmp_text value = {0};
    bool has = kmp_manifest_text(f->manifest, key, &value);
    const char *kept = has ? kmp_text_keep(&value, &f->arena) : NULL;
    f->arena.failed = f->arena.failed || value.failed;
    kmp_text_free(&value);
    return kept;
}

/* An empty text: not given. */
static bool read_text(kempe_folder *f, const char *key, const char **text)
{
    const char *kept = keep_text(f, key);
    *text = kept && *kept ? kept : NULL;
    return kept;
}

static bool read_number(kempe_folder *f, const char *key, double *number)
{
    (void)kmp_manifest_double(f->manifest, key, number);
    return true;
}

static bool read_long(kempe_folder *f, const char *key, long *number)
{
    int whole = 0;
    (void)kmp_manifest_int(f->manifest, key, 0, INT_MAX, &whole);
    *number = whole;
    return true;
}

/* The options of the run that wrote the manifest; false: a text is missing. */
static bool read_run(kempe_folder *f)
{
    const bool check = strstr(f->manifest, "\n  \"convergence_check\": false") == NULL;
    bool whole = true;
    f->run = (kempe_run_options){.size = sizeof f->run, .no_convergence_check = !check};
    (void)read_number(f, "output_step", &f->run.output_step); /* of histories */
#define READ(value) _Generic(value, double * : read_number, long * : read_long, const char ** : read_text)
#define KMP_RUN_OPTION(name, type, key, engine, folder, ...)                                                           \
    KMP_RUN_IF_FOLDER_##folder(whole = READ(&f->run.name)(f, #name, &f->run.name) && whole;)
#include "model/data/run_options.def"
#undef KMP_RUN_OPTION
    return whole;
}

static kempe_status fill(kempe_folder *f)
{
    int format = 0;
    kempe_context *context = f->context;
    KMP_TRY(kmp_made(context, !f->arena.failed));
    bool known = kmp_manifest_int(f->manifest, "format", 0, INT_MAX, &format);
    if (known && format != KMP_FOLDER_FORMAT)
        return kmp_complain(context, f->path, 0, 0,
                            "the folder has format %d, and this version of Kempe reads format %d", format,
                            KMP_FOLDER_FORMAT);
    f->model = keep_text(f, "model");
    f->file = keep_text(f, "file");
    f->hash = keep_text(f, "hash");
    bool texts = read_run(f) && f->model && f->file && f->hash;
    KMP_TRY(kmp_made(context, !f->arena.failed));
    if (!known || !texts || !kmp_manifest_int(f->manifest, "instances", 0, INT_MAX, &f->instances) ||
        !kmp_manifest_int(f->manifest, "chunk", 1, INT_MAX, &f->chunk) ||
        !kmp_manifest_int(f->manifest, "parts", 0, KMP_FOLDER_MOST_PARTS, &f->parts) ||
        f->parts != (f->instances > 0 ? (f->instances - 1) / f->chunk + 1 : 0))
        return kmp_complain(context, f->path, 0, 0, "manifest.json is not a manifest of Kempe, or it is damaged");
    if (!kmp_manifest_is_whole(f->manifest, f->hash))
        return kmp_complain(
            context, f->path, 0, 0,
            "manifest.json is damaged: it is not the text that its hash was made of; use a folder whose "
            "manifest nobody has changed");
    f->history = keep_text(f, "history");
    KMP_TRY(kmp_made(context, !f->arena.failed));
    return kmp_instance_ranges_read(context, &f->arena, f->history, f->instances, &f->ranges);
}

kempe_status kmp_folder_of(kempe_context *context, const char *path, kmp_text *manifest, kempe_folder **folder)
{
    kempe_folder *f = manifest->failed ? NULL : KMP_NEW(kempe_folder, 1);
    if (!f) {
        kmp_text_free(manifest);
        return kmp_fail_memory(context);
    }
    f->context = context;
    f->path = kmp_arena_strdup(&f->arena, path);
    f->manifest = kmp_text_keep(manifest, &f->arena);
    kempe_status status = fill(f);
    return KMP_GIVE_OR_FREE(status, folder, f, kempe_folder_free);
}

void kmp_folder_clear(kempe_folder *f)
{
    kempe_table_free(f->shape);
    kempe_table_free(f->measured);
    kempe_statistics_free(f->statistics);
    kmp_instance_causes_free(&f->causes);
    f->shape = f->measured = NULL;
    f->statistics = NULL;
}

void kempe_folder_free(kempe_folder *f)
{
    if (!f)
        return;
    kmp_folder_clear(f);
    kmp_free(f->warnings);
    kmp_arena_free(&f->arena);
    kmp_free(f);
}

kempe_status kempe_folder_open(kempe_context *context, const char *path, kempe_folder **folder)
{
    KMP_WANTED(NULL, context, "context");
    KMP_WANTED(context, path, "path");
    KMP_WANTED(context, folder, "folder");
    char *text = NULL;
    kmp_context_clear(context);
    KMP_TRY(kmp_manifest_read(context, path, &text));
    if (!text)
        return kmp_complain(context, path, 0, 0, "no results are here: manifest.json is missing");
    kmp_text manifest = {0};
    kmp_text_put(&manifest, text);
    kmp_free(text);
    KMP_TRY(kmp_folder_of(context, path, &manifest, folder));
    kmp_folder_count(*folder);
    return KEMPE_OK;
}

KMP_GETTER(const char *kempe_folder_model_file(const kempe_folder *folder), folder, folder->file, "")

void kempe_folder_run_options(const kempe_folder *folder, kempe_run_options *run)
{
    KMP_GIVEN(folder && run, );
    *run = folder->run;
}

KMP_GETTER(int kempe_folder_instance_count(const kempe_folder *folder), folder, folder->instances, 0)
KMP_GETTER(int kempe_folder_part_count(const kempe_folder *folder), folder, folder->parts, 0)
KMP_GETTER(int kempe_folder_whole_count(const kempe_folder *folder), folder, folder->whole, 0)

/* -- description ------------------------------------------------------------------------------------- */

static const char *plural(long count)
{
    return count == 1 ? "" : "s";
}

/* The folder and its parts; the run of the manifest, with the time of the instances that were computed now. */
static void put_run(kmp_text *text, const kempe_folder *f)
{
    const kmp_batch_totals *t = &f->totals;
    kmp_text line = {0};
    kmp_text_printf(&line, "%s: %d of %d part%s whole", f->path, f->whole, f->parts, plural(f->parts));
    if (f->ran && t->sums.count < f->instances)
        kmp_text_printf(&line, ", of %d instance%s in all", f->instances, plural(f->instances));
    if (f->ran)
        kmp_text_printf(&line, ", %d of them made now", f->ran_parts);
    if (f->checked)
        kmp_text_printf(&line, ", %d damaged", f->damaged);
    kmp_text_printf(&line, "; 0 to %.6g s, rtol %g, atol %g", f->run.t_end, f->run.rtol, f->run.atol);
    if (t->sums.count > 0)
        kmp_text_printf(&line, "; %.3g ms per instance, %.2g s on %d thread%s", 1e3 * t->cpu_s / (double)t->sums.count,
                        f->wall_s, t->threads, plural(t->threads));
    kmp_print_wrapped(text, "folder    ", LABEL, line.s ? line.s : "");
    kmp_text_free_part(text, &line);
    if (f->history)
        kmp_text_printf(text, "history   of instances %s in %s/history\n", f->history, f->path);
}

static void put_command(kmp_text *text, const char *label, const char *command, const char *path, const char *end)
{
    kmp_text_printf(text, "%-10s%s ", label, command);
    kmp_text_shell(text, path);
    kmp_text_put(text, end);
}

/* The next commands. */
static void put_next(kmp_text *text, const kempe_folder *f)
{
    const int missing = f->parts - f->whole;
    if (missing == 0)
        put_command(text, "next", "kempe gather", f->path,
                    f->checked ? " -o FILE.csv   writes one table\n"
                               : " -o FILE.csv   checks the parts and writes one table\n");
    if (missing == 0 && f->causes.count > 0) {
        put_command(text, "", "kempe simulate --from", f->path, "");
        kmp_text_printf(text, " --instance %ld   repeats the first that failed\n", f->causes.cause[0].first + 1);
    }
    if (missing == 0)
        return;
    kmp_text_printf(text, "missing   %d of %d part%s", missing, f->parts, plural(f->parts));
    if (f->elsewhere > 0)
        kmp_text_printf(text, "; other processes work on %d of them", f->elsewhere);
    kmp_text_put(text, "; the run's command with --resume runs them\n");
}

/* A run judges its own parts; parts that were there before it are examined by a check. */
static kempe_outcome outcome_of(const kempe_folder *f)
{
    const kmp_instance_sums *sums = &f->totals.sums, *rows = &f->rows;
    if (f->interrupted || (f->checked && (f->whole < f->parts || f->damaged > 0)))
        return f->interrupted ? KEMPE_OUTCOME_STOPPED : KEMPE_OUTCOME_FAILED;
    if (!f->ran && rows->failed > 0 && rows->ok == 0)
        return KEMPE_OUTCOME_FAILED;
    if (!f->ran)
        return kmp_outcome_checked(rows->stopped + rows->failed + rows->distrusted > 0 ? KEMPE_UNTRUSTED : KEMPE_OK,
                                   rows->repeated > 0);
    bool right = sums->ok == sums->count && sums->not_converged == 0;
    return right ? kmp_outcome_checked(f->doubted ? KEMPE_UNTRUSTED : KEMPE_OK,
                                       sums->repeated > 0 && f->ran_parts == f->whole)
                 : kmp_instances_outcome(sums);
}

static void put_text(kmp_text *text, const void *result)
{
    const kempe_folder *f = result;
    kmp_instance_sums sums = f->ran ? f->totals.sums : f->rows;
    if (f->checked && !f->ran)
        sums.count = f->rows.ok + f->rows.stopped + f->rows.failed;
    if (sums.count == 0) /* nothing ran, or was checked */
        sums.count = sums.ok = f->instances;
    kmp_instances_put_answer(text, f->model, outcome_of(f), &sums, &f->causes);
    kmp_text at = {0};
    if (kmp_manifest_text(f->manifest, "at", &at))
        kmp_starts_show(text, "instance", at.s);
    kmp_text_free_part(text, &at);
    if (f->interrupted)
        kmp_text_put(text, "  interrupted\n");
    kmp_print_doubts(text, outcome_of(f), f->warnings);
    if (!f->ran && sums.distrusted > 0) {
        kmp_text said = {0};
        kmp_instances_put_distrusted(&said, &sums);
        kmp_print_wrapped(text, "  ", 4, said.s ? said.s : "");
        kmp_text_free_part(text, &said);
    }
    if (f->ran && f->totals.sums.count > 0)
        kmp_instances_put_accuracy(text, "accuracy", &sums);
    put_run(text, f);
    put_next(text, f);
    kmp_instances_put_statistics(text, f->statistics);
}

static void put_json(kmp_text *text, const void *result)
{
    const kempe_folder *f = result;
    kmp_json json = kmp_json_begin(text);
    kmp_json_put(&json, "{ model %s status %s reason %s build_s %g", f->model, kempe_outcome_text(outcome_of(f)),
                 f->interrupted ? "interrupted" : "", (double)NAN);
    kmp_json_put(&json, "folder %s hash %s instances %d parts %d chunk %d whole %d missing %d", f->path, f->hash,
                 f->instances, f->parts, f->chunk, f->whole, f->parts - f->whole);
    if (f->warnings)
        kmp_print_lines(&json, "warnings", f->warnings);
    if (f->history)
        kmp_json_put(&json, "history %s", f->history);
    if (f->checked)
        kmp_json_put(&json, "damaged %d complete %ld stopped %ld failed %ld", f->damaged, f->rows.ok, f->rows.stopped,
                     f->rows.failed);
    if (f->ran)
        kmp_json_put(&json,
                     "run { parts %d instances %ld complete %ld stopped %ld failed %ld not_converged %ld separate %ld "
                     "elsewhere %d threads %d cpu_s %g wall_s %g }",
                     f->ran_parts, f->totals.sums.count, f->totals.sums.ok, f->totals.sums.stopped,
                     f->totals.sums.failed, f->totals.sums.not_converged, f->totals.alone, f->elsewhere,
                     f->totals.threads, f->totals.cpu_s, f->wall_s);
    if (f->statistics)
        kmp_statistics_put(&json, "statistics", f->statistics);
    kmp_json_put(&json, "}");
}

KMP_PRINT(kempe_folder, folder, folder->context, put_json, put_text)
