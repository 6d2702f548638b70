/* SPDX-License-Identifier: BSD-3-Clause */
/* An ensemble run into a folder: chunk after chunk, each a whole part. Memory is that of one chunk. */
#include "base/clock.h"
#include "base/file.h"
#include "base/memory.h"
#include "ensemble/histories.h"
#include "ensemble/manifest.h"
#include "ensemble/processes/part_claims.h"
#include "ensemble/processes/shard.h"
#include "ensemble/result_folder.h"
#include "ensemble/sampling/values.h"
#include "output/parquet.h"
#include <stdio.h>
#include <string.h>

typedef struct folder_run {
    kempe_ensemble *ensemble;
    kempe_context *context;
    const kempe_run_options *run;
    int lanes;
    kempe_folder *folder;
    kmp_claims *claims;
    bool *done; /* of the parts of this run */
    long before, total;
    char first_failure[200];
} folder_run;

/* -- the folder -------------------------------------------------------------------------------------- */

/* The chunk that is given, that of the folder, or the usual one. */
static int chunk_of(const kempe_folder_options *options, const char *manifest, int instances)
{
    int chunk;
    if (options->chunk > 0)
        return options->chunk;
    return manifest && kmp_manifest_int(manifest, "chunk", 1, 1 << 30, &chunk) ? chunk : kmp_folder_chunk(instances);
}

/* Compares the manifest that is there with that of this run. */
static kempe_status check_manifest(kempe_context *context, const char *path, const char *there, const kmp_text *here)
{
    kmp_text why = {0};
    kempe_status status = KEMPE_OK;
    if (!kmp_manifest_same(there, here->s, &why))
        status = why.failed ? kmp_fail_memory(context)
                            : kmp_complain(context, path, 0, 0,
                                           "%s; choose another folder, or run the study that is in this one", why.s);
    kmp_text_free(&why);
    return status;
}

/* Makes the manifest, unless another process is first; then it is compared. */
static kempe_status make_manifest(kempe_context *context, const char *path, const kmp_text *manifest, bool joins)
{
    kmp_text name = {0};
    bool made = false;
    char *there = NULL;
    kmp_folder_put_manifest(&name, path);
    kempe_status status = kmp_made(context, !name.failed);
    if (status == KEMPE_OK)
        status = kmp_file_make(context, name.s, manifest->s, true, &made);
    kmp_text_free(&name);
    if (status != KEMPE_OK || made)
        return status;
    if (!joins)
        return kmp_complain(context, path, 0, 0, "another run has begun in this folder; --resume shares its work");
    KMP_TRY(kmp_manifest_read(context, path, &there));
    status = kmp_made(context, there);
    if (status == KEMPE_OK)
        status = check_manifest(context, path, there, manifest);
    kmp_free(there);
    return status;
}

/* Reports wrong words of --history before a folder is made. */
static kempe_status check_history(const folder_run *r, const char *words, int instances)
{
    kmp_arena arena = {0};
    kmp_instance_ranges ranges;
    kempe_status status = kmp_instance_ranges_read(r->context, &arena, words, instances, &ranges);
    kmp_arena_free(&arena);
    return status;
}

/* Makes the folder of histories. */
static kempe_status make_history_folder(const folder_run *r)
{
    kmp_text path = {0};
    if (!r->folder->history)
        return KEMPE_OK;
    kmp_text_printf(&path, "%s/history", r->folder->path);
    kempe_status status = kmp_made(r->context, !path.failed);
    if (status == KEMPE_OK)
        status = kmp_folder_make(r->context, path.s);
    kmp_text_free(&path);
    return status;
}

/* Opens or makes the folder of a run. */
static kempe_status enter(folder_run *r, const char *path, const kempe_folder_options *options)
{
    char *there = NULL;
    kmp_text manifest = {0};
    bool joins = options->resume || options->shard;
    int instances = kmp_ensemble_values(r->ensemble)->count;
    KMP_TRY(check_history(r, options->history, instances));
    KMP_TRY(kmp_folder_make(r->context, path));
    KMP_TRY(kmp_manifest_read(r->context, path, &there));
    kempe_status status = kmp_manifest_put(r->ensemble, r->run, r->lanes, chunk_of(options, there, instances),
                                           options->history, &manifest);
    if (status == KEMPE_OK && there && !joins)
        status = kmp_complain(r->context, path, 0, 0,
                              "the folder has results; --resume runs what is missing, another folder begins anew");
    if (status == KEMPE_OK && there)
        status = check_manifest(r->context, path, there, &manifest);
    if (status == KEMPE_OK && !there)
        status = make_manifest(r->context, path, &manifest, joins);
    if (status == KEMPE_OK)
        status = kmp_folder_of(r->context, path, &manifest, &r->folder);
    kmp_text_free(&manifest);
    kmp_free(there);
    if (status == KEMPE_OK)
        status = make_history_folder(r);
    if (status != KEMPE_OK)
        kempe_folder_free(r->folder);
    return status;
}

/* -- one part ---------------------------------------------------------------------------------------- */

/* Writes the table of a part, which is freed, to a path. */
static kempe_status write_table(const folder_run *r, kempe_table *table, int part, const kmp_text *path)
{
    kmp_text text = {0};
    char number[16], first[16];
    (void)snprintf(number, sizeof number, "%d", part);
    (void)snprintf(first, sizeof first, "%d", part * r->folder->chunk);
    const kmp_parquet_note notes[] = {{"kempe.run", r->folder->hash}, {"kempe.part", number}, {"kempe.first", first}};
    kmp_parquet_put(&text, table, 3, notes);
    kempe_table_free(table);
    kempe_status status = kmp_made(r->context, !path->failed && !text.failed);
    if (status == KEMPE_OK)
        status = kmp_file_write_lasting(r->context, path->s, &text);
    kmp_text_free(&text);
    return status;
}

/* Histories are written before their part: a whole part has them. */
static kempe_status write_history(const folder_run *r, int part)
{
    kempe_table *table = NULL;
    kmp_text path = {0};
    int first = part * r->folder->chunk, count = kmp_folder_part_size(r->folder, part);
    bool degrees = kmp_context_use_degrees(r->context, false); /* parts are in SI */
    kempe_status status = kmp_histories(r->ensemble, r->run, &r->folder->ranges, first, count, &table);
    (void)kmp_context_use_degrees(r->context, degrees);
    kmp_folder_put_history(&path, r->folder->path, part);
    if (status == KEMPE_OK)
        status = write_table(r, table, part, &path);
    kmp_text_free(&path);
    return status;
}

/* Writes the table of a part, which is freed. */
static kempe_status write_part(const folder_run *r, kempe_table *table, int part)
{
    kmp_text path = {0};
    kmp_folder_put_part(&path, r->folder->path, part);
    kempe_status status = write_table(r, table, part, &path);
    if (status == KEMPE_E_IO && kmp_folder_has_part(r->folder, part)) {
        kmp_context_clear(r->context); /* another process has made it, and ended the run */
        status = KEMPE_OK;
    }
    kmp_text_free(&path);
    return status;
}

/* Histories and rows of a batch, which counts where they could be written. */
static kempe_status keep_part(folder_run *r, const kempe_ensemble_result *batch, int part)
{
    kempe_table *table = NULL;
    kmp_batch_totals totals = r->folder->totals;
    if (kmp_folder_wants_history(r->folder, part))
        KMP_TRY(write_history(r, part));
    bool degrees = kmp_context_use_degrees(r->context, false); /* parts are in SI */
    kempe_status status = kempe_ensemble_result_table(batch, "instances", &table);
    (void)kmp_context_use_degrees(r->context, degrees);
    KMP_TRY(status);
    kmp_batch_add(batch, table, &totals);
    KMP_TRY(write_part(r, table, part));
    r->folder->totals = totals;
    r->folder->ran_parts++;
    for (int k = 0; k < kempe_ensemble_result_count(batch) && !*r->first_failure; k++)
        if (strcmp(kempe_ensemble_result_status(batch, k), "failed") == 0)
            (void)snprintf(r->first_failure, sizeof r->first_failure, "%s", kempe_ensemble_result_reason(batch, k));
    return KEMPE_OK;
}

static kempe_status run_part(folder_run *r, int part)
{
    kempe_ensemble_result *batch = NULL;
    const kmp_batch_range range = {.first = part * r->folder->chunk,
                                   .count = kmp_folder_part_size(r->folder, part),
                                   .before = r->before,
                                   .total = r->total};
    kempe_status status = kmp_batch_new(r->ensemble, r->run, r->lanes, &range, &batch);
    if (kmp_is_complete(status))
        status = keep_part(r, batch, part);
    kempe_ensemble_result_free(batch);
    return status;
}

/* Runs a part unless it is there or another process has it. *fresh: it was made or found. */
static kempe_status try_part(folder_run *r, int part, bool *fresh)
{
    bool taken = false;
    if (!kmp_folder_has_part(r->folder, part)) {
        KMP_TRY(kmp_claims_take(r->claims, part, &taken));
        if (!taken)
            return KEMPE_OK;
        kempe_status status = kmp_folder_has_part(r->folder, part) ? KEMPE_OK : run_part(r, part);
        kmp_claims_release(r->claims);
        KMP_TRY(status);
    }
    r->done[part] = *fresh = true;
    r->before += kmp_folder_part_size(r->folder, part);
    return KEMPE_OK;
}

/* -- all parts --------------------------------------------------------------------------------------- */

static void begin(folder_run *r)
{
    const kempe_folder *f = r->folder;
    for (int k = f->first; k < f->parts; k += f->step)
        r->total += kmp_folder_part_size(f, k);
}

static void end(folder_run *r)
{
    kempe_folder *f = r->folder;
    kmp_folder_count(f);
    for (int k = f->first; k < f->parts; k += f->step)
        f->missing += !r->done[k];
    f->elsewhere = f->interrupted ? 0 : f->missing;
    if (f->whole == f->parts)
        kmp_claims_clear(f->path);
}

static kempe_status run_folder(folder_run *r)
{
    const kmp_instance_sums *sums = &r->folder->totals.sums;
    double began = kmp_wall_now();
    r->folder->ran = true;
    r->done = KMP_NEW(bool, r->folder->parts);
    KMP_TRY(kmp_made(r->context, r->done));
    begin(r);
    KMP_TRY(kmp_claims_new(r->context, r->folder->path, &r->claims));
    /* Parts of other processes are tried again as long as there is progress: their owners may have ended. */
    const kempe_folder *f = r->folder;
    kempe_status status = KEMPE_OK;
    for (bool fresh = true; fresh && status == KEMPE_OK;) {
        fresh = false;
        for (int k = f->first; k < f->parts && status == KEMPE_OK; k += f->step) {
            if (r->done[k])
                continue;
            status = kmp_interrupted(r->context) ? KEMPE_STOPPED : try_part(r, k, &fresh);
        }
    }
    kmp_claims_free(r->claims);
    r->folder->interrupted = status == KEMPE_STOPPED;
    r->folder->wall_s = kmp_wall_now() - began;
    end(r);
    KMP_TRY(kmp_instances_warn(r->context, sums));
    if (status == KEMPE_OK && sums->count > 0 && sums->failed == sums->count)
        return kmp_fail(r->context, KEMPE_E_FAILED, "no instance of this run reached its end; the first one: %s",
                        r->first_failure);
    return status;
}

kempe_status kempe_ensemble_run_folder(kempe_ensemble *ensemble, const kempe_run_options *run, int lanes,
                                       const char *path, const kempe_folder_options *options, kempe_folder **folder)
{
    KMP_WANTED(NULL, ensemble, "ensemble");
    kempe_context *context = kmp_ensemble_model(ensemble)->context;
    KMP_WANTED(context, path, "path");
    KMP_WANTED(context, folder, "folder");
    KMP_OPTIONS(context, kempe_run_options, run);
    KMP_OPTIONS(context, kempe_folder_options, options);
    folder_run r = {.ensemble = ensemble, .context = context, .run = run, .lanes = lanes};
    kmp_shard shard;
    kmp_ensemble_begin(ensemble);
    KMP_TRY(kmp_batch_check_lanes(ensemble, lanes));
    if (options->chunk < 0)
        return kmp_fail(context, KEMPE_E_ARGUMENT, "a part has at least one instance, not %d", options->chunk);
    const int instances = kmp_ensemble_values(ensemble)->count;
    if (options->chunk > 0 && instances / options->chunk >= KMP_FOLDER_MOST_PARTS)
        return kmp_fail(context, KEMPE_E_ARGUMENT,
                        "%d instances in parts of %d are more than %d parts; choose more instances of a part (--chunk)",
                        instances, options->chunk, KMP_FOLDER_MOST_PARTS);
    KMP_TRY(kmp_shard_read(context, options->shard, &shard));
    KMP_TRY(enter(&r, path, options));
    r.folder->first = shard.number - 1;
    r.folder->step = shard.count;
    kempe_status status = run_folder(&r);
    kmp_free(r.done);
    status = kmp_context_verdict(context, status);
    r.folder->doubted = status == KEMPE_UNTRUSTED;
    if (status >= 0 || status == KEMPE_E_FAILED)
        *folder = r.folder;
    else
        kempe_folder_free(r.folder);
    return status;
}
