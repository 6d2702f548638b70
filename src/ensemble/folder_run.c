/* SPDX-License-Identifier: BSD-3-Clause */
/* An ensemble run into a folder: chunk after chunk, each a whole part. Memory is needed for one chunk. */
#include "base/context.h"
#include "base/file.h"
#include "base/memory.h"
#include "ensemble/histories.h"
#include "ensemble/lasting_files.h"
#include "ensemble/manifest.h"
#include "ensemble/result_folder.h"
#include "ensemble/sampling/values.h"
#include "model/data/model_context.h"
#include "output/parquet.h"
#include "platform/platform.h"
#include "studies/simulate/trajectory.h"
#include <errno.h>
#include <limits.h>
#include <pthread.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <time.h>

/* -- claims ------------------------------------------------------------------------------------------------- */

/* Claims on the parts of a folder: files that are made exclusively, so that processes on several hosts share the work.
 * A claim has the name of its process. Another process takes it over when that process has ended: on the same host by
 * its process number and start time, on another one when no process has touched the claim for STALE seconds. A thread
 * of the owner touches it. A part that two processes make nevertheless has the same bytes from both. */

enum { STALE = 300, BEAT = 15 }; /* s */

static const char subfolder[] = "claims", unfinished[] = ".tmp-";

typedef struct process_claims {
    kempe_context *context;
    kmp_text folder; /* of the process_claims */
    kmp_text owner;  /* content of the claims of this process */
    kmp_text held;   /* path; empty: none */
    pthread_t beat;
    pthread_mutex_t lock; /* of `held` and `ends` */
    pthread_cond_t wake;
    bool has_beat, ends;
} process_claims;

/* -- claims of others -------------------------------------------------------------------------------- */

/* Seconds since the last touch of a file by the clock of its file system; negative: unknown. */
static double age_of(process_claims *c, const char *path)
{
    kmp_path_state about, now;
    kmp_text probe = {0};
    double age = -1;
    kmp_text_printf(&probe, "%s/now%s%ld-XXXXXX", c->folder.s, unfinished, kmp_process_number());
    int fd = probe.failed ? -1 : kmp_file_temporary(probe.s);
    if (fd >= 0) {
        if (kmp_file_look(fd, &now) && kmp_path_look(path, &about))
            age = (double)(now.changed - about.changed);
        (void)kmp_file_close(fd);
        (void)kmp_path_remove(probe.s);
    }
    kmp_text_free(&probe);
    return age;
}

/* True if the owner of a claim has ended. */
static bool is_stale(process_claims *c, const char *path, const char *content)
{
    long process = 0;
    unsigned long long start = 0;
    size_t host = strcspn(content, " ");
    bool here = strncmp(content, c->owner.s, host + 1) == 0 && content[host] == ' ';
    if (here && sscanf(content + host, " %ld %llu", &process, &start) == 2)
        return kmp_process_start(process) != start;
    return age_of(c, path) > STALE;
}

/* Removes a claim whose owner has ended. It takes another name first: of several processes that try, one does. */
static bool remove_stale(process_claims *c, const char *path)
{
    char *content = NULL;
    size_t length;
    kmp_text name = {0};
    bool removed = false;
    if (kmp_file_read(c->context, KMP_FILE_RECORD, path, &content, &length) != KEMPE_OK) {
        kmp_context_clear(c->context);
        return !kmp_path_exists(path); /* its owner has released it */
    }
    if (is_stale(c, path, content)) {
        kmp_text_printf(&name, "%s%sold-%ld", path, unfinished, kmp_process_number());
        removed = !name.failed && kmp_path_rename(path, name.s) == 0 && kmp_path_remove(name.s);
    }
    kmp_text_free(&name);
    kmp_free(content);
    return removed;
}

/* -- own claims -------------------------------------------------------------------------------------- */

/* Touches the claim from time to time, so that other hosts see that its owner lives. */
static void *beat(void *self)
{
    process_claims *c = self;
    pthread_mutex_lock(&c->lock);
    while (!c->ends) {
        struct timespec until;
        clock_gettime(CLOCK_REALTIME, &until);
        until.tv_sec += BEAT;
        (void)pthread_cond_timedwait(&c->wake, &c->lock, &until);
        if (c->held.length > 0)
            kmp_path_touch(c->held.s);
    }
    pthread_mutex_unlock(&c->lock);
    return NULL;
}

static void hold(process_claims *c, kmp_text path)
{
    pthread_mutex_lock(&c->lock);
    kmp_text_free(&c->held);
    c->held = path;
    pthread_mutex_unlock(&c->lock);
}

static void claims_release(process_claims *c)
{
    if (c->held.length > 0)
        (void)kmp_path_remove(c->held.s);
    hold(c, (kmp_text){0});
}

/* Releases a claim that is still held. */
static void claims_free(process_claims *c)
{
    if (!c)
        return;
    claims_release(c);
    if (c->has_beat) {
        pthread_mutex_lock(&c->lock);
        c->ends = true;
        pthread_cond_signal(&c->wake);
        pthread_mutex_unlock(&c->lock);
        pthread_join(c->beat, NULL);
    }
    if (c->folder.length > 0)
        (void)kmp_folder_remove(c->folder.s); /* fails where others have process_claims */
    pthread_cond_destroy(&c->wake);
    pthread_mutex_destroy(&c->lock);
    kmp_text_free(&c->folder);
    kmp_text_free(&c->owner);
    kmp_text_free(&c->held);
    kmp_free(c);
}

/* Makes the subfolder of the claims. KEMPE_E_IO: it cannot be made. */
static kempe_status claims_new(kempe_context *context, const char *folder, process_claims **claims)
{
    KMP_MAKE(context, process_claims, c);
    c->context = context;
    pthread_mutex_init(&c->lock, NULL);
    pthread_cond_init(&c->wake, NULL);
    kmp_text_printf(&c->folder, "%s/%s", folder, subfolder);
    char word[KMP_SYSTEM_WORD];
    kmp_system_word(word);
    kmp_text_printf(&c->owner, "%s %ld %llu\n", word, kmp_process_number(), kmp_process_start(kmp_process_number()));
    kempe_status status = kmp_made(context, !c->folder.failed && !c->owner.failed);
    if (status == KEMPE_OK)
        status = kmp_folder_make(context, c->folder.s);
    if (status == KEMPE_OK) /* signals go to the other threads */
        status = kmp_made(context, c->has_beat = kmp_thread_start_deaf(&c->beat, beat, c));
    return KMP_GIVE_OR_FREE(status, claims, c, claims_free);
}

/* Makes the claim, and its folder again where another process has removed it with its own last claim. */
static kempe_status make_claim(process_claims *c, const char *path, bool *taken)
{
    enum { TRIES = 3 };
    kempe_status status = KEMPE_OK;
    *taken = false;
    for (int k = 0; k < TRIES && !*taken; k++) {
        status = kmp_file_make(c->context, path, c->owner.s, false, taken);
        if (status == KEMPE_OK && !*taken && !remove_stale(c, path))
            return KEMPE_OK;
        if (status == KEMPE_E_IO && !kmp_path_exists(c->folder.s)) {
            kmp_context_clear(c->context);
            status = kmp_folder_make(c->context, c->folder.s);
        }
        if (status != KEMPE_OK)
            return status;
    }
    return status;
}

/* Claims a part, one at a time; *taken is false where another living process has it. KEMPE_E_IO. */
static kempe_status claims_take(process_claims *c, int part, bool *taken)
{
    kmp_text path = {0};
    kmp_text_printf(&path, "%s/%06d", c->folder.s, part);
    kempe_status status = kmp_made(c->context, !path.failed);
    *taken = false;
    if (status == KEMPE_OK)
        status = make_claim(c, path.s, taken);
    if (*taken)
        hold(c, path);
    else
        kmp_text_free(&path);
    return status;
}

/* -- the end ----------------------------------------------------------------------------------------- */

/* Removes the files of a folder whose names have `part` (all: NULL). */
static void remove_files(const char *folder, const char *part)
{
    kmp_folder_names *names = kmp_folder_names_begin(folder);
    kmp_path_state about;
    for (const char *name = names ? kmp_folder_names_next(names) : NULL; name; name = kmp_folder_names_next(names)) {
        kmp_text path = {0};
        kmp_text_printf(&path, "%s/%s", folder, name);
        if (!path.failed && (!part || strstr(name, part)) && kmp_path_look_here(path.s, &about) &&
            about.kind == KMP_PATH_FILE)
            (void)kmp_path_remove(path.s);
        kmp_text_free(&path);
    }
    kmp_folder_names_end(names);
}

/* Removes all claims, their folder, and unfinished files of parts, when every part is whole. */
static void claims_clear(const char *folder)
{
    kmp_text path = {0};
    kmp_text_printf(&path, "%s/%s", folder, subfolder);
    if (!path.failed) {
        remove_files(path.s, NULL);
        (void)kmp_folder_remove(path.s);
        remove_files(folder, unfinished);
    }
    kmp_text_free(&path);
}

/* -- shares of processes ------------------------------------------------------------------------------------ */

/* Number and count of this process: number from 1 to count. */
typedef struct process_share {
    int number, count;
} process_share;

/* Variables of launchers, in the order in which they count: mpirun in an allocation of Slurm has its own. */
static const struct {
    const char *engine, *number, *count; /* number: from 0 on */
} launchers[] = {{"Open MPI", "OMPI_COMM_WORLD_RANK", "OMPI_COMM_WORLD_SIZE"},
                 {"PMI", "PMI_RANK", "PMI_SIZE"},
                 {"srun", "SLURM_PROCID", "SLURM_STEP_NUM_TASKS"},
                 {"Slurm", "SLURM_PROCID", "SLURM_NTASKS"}};

static bool to_whole(const char *text, int *value)
{
    char *end;
    long x = text && *text >= '0' && *text <= '9' ? strtol(text, &end, 10) : -1;
    if (x < 0 || x > 1000000 || *end)
        return false;
    *value = (int)x;
    return true;
}

/* The process within its launcher; none: 0 of 1. */
static kempe_status find_rank(kempe_context *context, int *index, int *count, bool *found)
{
    *index = 0;
    *count = 1;
    for (size_t k = 0; k < sizeof launchers / sizeof *launchers; k++)
        if (to_whole(getenv(launchers[k].number), index) && to_whole(getenv(launchers[k].count), count)) {
            *found = true;
            return *index < *count
                       ? KEMPE_OK
                       : kmp_fail(context, KEMPE_E_ARGUMENT, "shard auto: the variables of %s say process %d of %d",
                                  launchers[k].engine, *index, *count);
        }
    *index = 0;
    *count = 1;
    return KEMPE_OK;
}

/* The task within a job array of Slurm, with its smallest number and step; none: 0 of 1. */
static kempe_status find_task(kempe_context *context, int *index, int *count, bool *found)
{
    int task, least = 0, step = 1;
    *index = 0;
    *count = 1;
    if (!to_whole(getenv("SLURM_ARRAY_TASK_ID"), &task) || !to_whole(getenv("SLURM_ARRAY_TASK_COUNT"), count)) {
        *count = 1;
        return KEMPE_OK;
    }
    (void)to_whole(getenv("SLURM_ARRAY_TASK_MIN"), &least);
    (void)to_whole(getenv("SLURM_ARRAY_TASK_STEP"), &step);
    *found = true;
    if (task < least || step < 1 || (task - least) % step != 0 || (task - least) / step >= *count)
        return kmp_fail(context, KEMPE_E_ARGUMENT,
                        "shard auto: task %d of the job array is none of %d from %d on in steps of %d; give the array "
                        "as FIRST-LAST, or --shard I/N",
                        task, *count, least, step);
    *index = (task - least) / step;
    return KEMPE_OK;
}

/* The tasks of an array, each with the processes of its launcher. GNU parallel does not give the number of its jobs:
 * they share all parts by claims. */
static kempe_status find_auto(kempe_context *context, process_share *shard)
{
    int task, tasks, rank, ranks, job;
    bool found = false;
    KMP_TRY(find_task(context, &task, &tasks, &found));
    KMP_TRY(find_rank(context, &rank, &ranks, &found));
    if (!found && !to_whole(getenv("PARALLEL_SEQ"), &job))
        return kmp_fail(context, KEMPE_E_ARGUMENT,
                        "shard auto: no variables of Slurm, Open MPI, PMI or GNU parallel are set; give I/N");
    *shard = (process_share){task * ranks + rank + 1, tasks * ranks};
    return KEMPE_OK;
}

/* Reads "I/N", or "auto": the variables of the engine that started this process. NULL: one share, all of it.
 * KEMPE_E_ARGUMENT: the word is neither, or no engine's variables are set. */
static kempe_status shard_read(kempe_context *context, const char *word, process_share *shard)
{
    char number[12] = "";
    *shard = (process_share){1, 1};
    if (!word)
        return KEMPE_OK;
    if (strcmp(word, "auto") == 0)
        return find_auto(context, shard);
    size_t length = strcspn(word, "/");
    if (length < sizeof number)
        memcpy(number, word, length);
    if (word[length] && to_whole(number, &shard->number) && to_whole(word + length + 1, &shard->count) &&
        shard->number >= 1 && shard->number <= shard->count)
        return KEMPE_OK;
    return kmp_fail(context, KEMPE_E_ARGUMENT, "shard '%s' is not I/N with 1 <= I <= N, as 2/7, or auto", word);
}

/* -- the run ------------------------------------------------------------------------------------------------ */

typedef struct folder_run {
    kempe_ensemble *ensemble;
    kempe_context *context;
    const kempe_run_options *run;
    int lanes;
    kempe_folder *folder;
    process_claims *claims;
    bool *done; /* of the parts of this run */
    long before, total;
    char first_failure[200];
} folder_run;

/* -- the folder -------------------------------------------------------------------------------------- */

/* Compares the manifest that is there with the manifest of this run. */
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
    kmp_arena arena = {0};
    kmp_instance_ranges ranges; /* wrong words of --history are reported before a folder is made */
    kempe_status status = kmp_instance_ranges_read(r->context, &arena, options->history, instances, &ranges);
    kmp_arena_free(&arena);
    KMP_TRY(status);
    KMP_TRY(kmp_folder_make(r->context, path));
    KMP_TRY(kmp_manifest_read(r->context, path, &there));
    int chunk = options->chunk; /* or the chunk of the folder, or the usual one */
    if (chunk <= 0 && !(there && kmp_manifest_int(there, "chunk", 1, 1 << 30, &chunk)))
        chunk = kmp_folder_chunk(instances);
    status = kmp_manifest_put(r->ensemble, r->run, r->lanes, chunk, options->history, &manifest);
    if (status == KEMPE_OK && there && !joins)
        status =
            kmp_complain(r->context, path, 0, 0,
                         "the folder has results: --resume runs what is missing; give another folder to begin again");
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
        status = kmp_lasting_file_write(r->context, path->s, &text);
    kmp_text_free(&text);
    return status;
}

/* Histories are written before their part: a whole part has them. */
static kempe_status write_history(const folder_run *r, int part)
{
    kempe_table *table = NULL;
    kmp_text path = {0};
    int first = part * r->folder->chunk, count = kmp_folder_part_size(r->folder, part);
    const kmp_shown_in shown = kmp_context_show_in(r->context, (kmp_shown_in){0}); /* parts are in SI */
    kempe_status status = kmp_histories(r->ensemble, r->run, &r->folder->ranges, first, count, &table);
    (void)kmp_context_show_in(r->context, shown);
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
    const kmp_shown_in shown = kmp_context_show_in(r->context, (kmp_shown_in){0}); /* parts are in SI */
    kempe_status status = kempe_ensemble_result_table(batch, "instances", &table);
    (void)kmp_context_show_in(r->context, shown);
    KMP_TRY(status);
    kmp_batch_add(batch, table, &totals);
    kmp_instance_causes_add(&r->folder->causes, table, (long)part * r->folder->chunk);
    KMP_TRY(write_part(r, table, part));
    r->folder->totals = totals;
    r->folder->ran_parts++;
    for (int k = 0; k < kempe_ensemble_result_count(batch) && !*r->first_failure; k++)
        if (kempe_ensemble_result_outcome(batch, k) == KEMPE_OUTCOME_FAILED)
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
        KMP_TRY(claims_take(r->claims, part, &taken));
        if (!taken)
            return KEMPE_OK;
        kempe_status status = kmp_folder_has_part(r->folder, part) ? KEMPE_OK : run_part(r, part);
        claims_release(r->claims);
        KMP_TRY(status);
    }
    r->done[part] = *fresh = true;
    r->before += kmp_folder_part_size(r->folder, part);
    return KEMPE_OK;
}

/* -- all parts --------------------------------------------------------------------------------------- */

static void end(folder_run *r)
{
    kempe_folder *f = r->folder;
    kmp_folder_count(f);
    for (int k = f->first; k < f->parts; k += f->step)
        f->missing += !r->done[k];
    f->elsewhere = f->interrupted ? 0 : f->missing;
    if (f->whole == f->parts)
        claims_clear(f->path);
}

static kempe_status run_folder(folder_run *r)
{
    const kmp_instance_sums *sums = &r->folder->totals.sums;
    double began = kmp_wall_now();
    r->folder->ran = true;
    r->done = KMP_NEW(bool, r->folder->parts);
    KMP_TRY(kmp_made(r->context, r->done));
    const kempe_folder *f = r->folder;
    for (int k = f->first; k < f->parts; k += f->step)
        r->total += kmp_folder_part_size(f, k);
    KMP_TRY(claims_new(r->context, r->folder->path, &r->claims));
    /* Parts of other processes are tried again as long as there is progress: their owners may have ended. */
    kempe_status status = KEMPE_OK;
    for (bool fresh = true; fresh && status == KEMPE_OK;) {
        fresh = false;
        for (int k = f->first; k < f->parts && status == KEMPE_OK; k += f->step) {
            if (r->done[k])
                continue;
            status = kmp_interrupted(r->context) ? KEMPE_STOPPED : try_part(r, k, &fresh);
        }
    }
    claims_free(r->claims);
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
    kempe_context *context = kmp_model_context(kmp_ensemble_model(ensemble));
    KMP_WANTED(context, path, "path");
    KMP_WANTED(context, folder, "folder");
    KMP_OPTIONS(context, kempe_run_options, run);
    KMP_OPTIONS(context, kempe_folder_options, options);
    KMP_TRY(kmp_run_options_check(context, run, KMP_STUDY_ENSEMBLE | (options->history ? KMP_STUDY_HISTORY : 0)));
    folder_run r = {.ensemble = ensemble, .context = context, .run = run, .lanes = lanes};
    process_share shard;
    kmp_ensemble_begin(ensemble);
    KMP_TRY(kmp_batch_check_lanes(context, lanes));
    if (options->chunk < 0)
        return kmp_fail(context, KEMPE_E_ARGUMENT, "a part has at least one instance, not %d", options->chunk);
    const int instances = kmp_ensemble_values(ensemble)->count;
    if (options->chunk > 0 && instances / options->chunk >= KMP_FOLDER_MOST_PARTS)
        return kmp_fail(context, KEMPE_E_ARGUMENT,
                        "%d instances in parts of %d are more than %d parts; choose more instances of a part (--chunk)",
                        instances, options->chunk, KMP_FOLDER_MOST_PARTS);
    KMP_TRY(shard_read(context, options->shard, &shard));
    KMP_TRY(enter(&r, path, options));
    r.folder->first = shard.number - 1;
    r.folder->step = shard.count;
    kempe_status status = run_folder(&r);
    kmp_free(r.done);
    status = kmp_context_verdict(context, status);
    r.folder->doubted = status == KEMPE_UNTRUSTED;
    r.folder->warnings = kmp_context_warnings(context);
    return KMP_GIVE_IF(status >= 0 || status == KEMPE_E_FAILED, status, folder, r.folder, kempe_folder_free);
}
