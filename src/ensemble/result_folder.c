/* SPDX-License-Identifier: BSD-3-Clause */
/* Result folders: opened, counted and described. */
#include "ensemble/result_folder.h"
#include "base/cache/digest.h"
#include "base/file.h"
#include "base/json.h"
#include "base/memory.h"
#include "ensemble/histories.h"
#include "ensemble/sampling/values.h"
#include "ensemble/statistics/statistics.h"
#include "model/data/model.h"
#include "output/print.h"
#include "studies/simulate/trajectory.h"
#include <errno.h>
#include <limits.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <unistd.h>

/* -- manifest ----------------------------------------------------------------------------------------------- */

/* The manifest of a result folder: a JSON object of plain members, one a line, each key once. It is written once and
 * compared line by line. Members of `apart` are not in its hash: they describe where things were, or are the hash. */

static const char *const apart[] = {"file", "values_file", "hash", NULL};

/* -- hashes ------------------------------------------------------------------------------------------ */

typedef char hash[KMP_HASH_SIZE + 1];

static void end_hash(kmp_digest *digest, hash out)
{
    static const char digit[] = "0123456789abcdef";
    unsigned char bytes[KMP_DIGEST_SIZE];
    kmp_digest_end(digest, bytes);
    for (int k = 0; k < KMP_DIGEST_SIZE; k++) {
        out[2 * k] = digit[bytes[k] >> 4];
        out[2 * k + 1] = digit[bytes[k] & 15];
    }
    out[KMP_HASH_SIZE] = '\0';
}

/* The content of all files and settings that made the model; of a model built in code its print. */
kempe_status kmp_manifest_hash_model(const kempe_model *model, hash out)
{
    kmp_digest digest;
    char *text = NULL;
    kmp_digest_begin(&digest);
    if (model->has_digest) {
        kmp_digest_add_part(&digest, model->digest, sizeof model->digest);
    } else {
        KMP_TRY(kempe_model_print(model, KEMPE_JSON, &text));
        kmp_digest_add_text(&digest, text);
        kempe_text_free(text);
    }
    kmp_digest_add_part(&digest, &model->closure_tolerance.value, sizeof(double));
    end_hash(&digest, out);
    return KEMPE_OK;
}

static kempe_status hash_equations(const kempe_system *system, hash out)
{
    kmp_digest digest;
    char *text = NULL;
    KMP_TRY(kempe_system_print(system, KEMPE_VIEW_PROGRAM, KEMPE_TEXT, &text));
    kmp_digest_begin(&digest);
    kmp_digest_add_text(&digest, text);
    kempe_text_free(text);
    end_hash(&digest, out);
    return KEMPE_OK;
}

/* Names, and the rows that are given or the options of the sample. */
static void hash_values(const kempe_values *values, hash out)
{
    kmp_digest digest;
    kmp_digest_begin(&digest);
    for (int k = 0; k < values->columns; k++)
        kmp_digest_add_text(&digest, values->name[k]);
    if (values->sampling) {
        kmp_digest_add_text(&digest, values->ranges);
        kmp_digest_add_text(&digest, values->correlations);
        kmp_digest_add_text(&digest, values->design);
        kmp_digest_add_part(&digest, &values->seed, sizeof values->seed);
    } else {
        kmp_digest_add_part(&digest, values->rows,
                            (size_t)values->columns * (size_t)values->count * sizeof *values->rows);
    }
    end_hash(&digest, out);
}

static kempe_status hash_columns(kempe_ensemble *ensemble, hash out)
{
    kmp_digest digest;
    kempe_table *table = NULL;
    kempe_context *context = kmp_ensemble_model(ensemble)->context;
    bool degrees = kmp_context_use_degrees(context, false); /* parts are in SI */
    kempe_status status = kmp_ensemble_columns(ensemble, &table);
    (void)kmp_context_use_degrees(context, degrees);
    KMP_TRY(status);
    kmp_digest_begin(&digest);
    for (int k = 0; k < kempe_table_column_count(table); k++) {
        kmp_digest_add_text(&digest, kempe_table_column_name(table, k));
        kmp_digest_add_text(&digest, kempe_table_unit(table, k));
    }
    kempe_table_free(table);
    end_hash(&digest, out);
    return KEMPE_OK;
}

/* -- writing ----------------------------------------------------------------------------------------- */

void kmp_manifest_hash_text(const char *manifest, char out[KMP_HASH_SIZE + 1])
{
    kmp_digest digest;
    kmp_digest_begin(&digest);
    for (const char *line = manifest; *line; line += strcspn(line, "\n") + (line[strcspn(line, "\n")] == '\n')) {
        bool counts = true;
        for (int k = 0; apart[k]; k++)
            counts = counts && !(strncmp(line, "  \"", 3) == 0 && strncmp(line + 3, apart[k], strlen(apart[k])) == 0 &&
                                 line[3 + strlen(apart[k])] == '"');
        size_t length = strcspn(line, "\n");
        if (counts) /* the comma after a member depends on what follows */
            kmp_digest_add_part(&digest, line, length - (length > 0 && line[length - 1] == ','));
    }
    end_hash(&digest, out);
}

static void put_string(kmp_json *json, const char *key, const char *text)
{
    kmp_json_string(json, key, text ? text : "");
}

static void put_options(kmp_json *json, const kempe_run_options *run)
{
#define PUT(value) _Generic(value, double : kmp_json_number, long : kmp_json_whole, const char * : put_string)
#define KMP_RUN_OPTION(name, type, key, engine, folder, ...)                                                           \
    KMP_RUN_IF_FOLDER_##folder(PUT(run->name)(json, #name, run->name);)
#include "model/data/run_options.def"
#undef KMP_RUN_OPTION
}

static void put_members(kmp_text *text, kempe_ensemble *ensemble, const kempe_run_options *run, int lanes, int chunk,
                        const char *history, hash *hashes, const char *whole)
{
    const kempe_model *model = kmp_ensemble_model(ensemble);
    const kempe_values *values = kmp_ensemble_values(ensemble);
    kmp_json json = kmp_json_begin(text);
    int parts = (values->count - 1) / chunk + 1;
    kmp_json_put(&json, "{ format %d kempe %s model %s file %s", KMP_FOLDER_FORMAT, kempe_version(), model->name,
                 model->file);
    kmp_json_put(&json, "instances %d chunk %d parts %d", values->count, chunk, values->count > 0 ? parts : 0);
    kmp_text names = {0};
    kmp_text_put(&names, "");
    for (int k = 0; k < values->columns; k++)
        kmp_text_printf(&names, "%s%s", k ? "," : "", values->name[k]);
    kmp_json_text(&json, "columns", &names);
    if (values->sampling)
        kmp_json_put(&json, "values %s sample %s correlations %s design %s seed %d", "sample", values->ranges,
                     values->correlations, values->design, values->seed);
    else
        kmp_json_put(&json, "values %s values_file %s", "table", values->file);
    put_options(&json, run);
    kmp_json_put(&json, "convergence_check %i separate_runs %i", !run->no_convergence_check, lanes < 0);
    if (history && *history)
        kmp_json_put(&json, "history %s output_step %g", history, run->output_step);
    kmp_json_put(&json, "quantities %s limits %s", kmp_ensemble_quantities(ensemble)->words,
                 kmp_ensemble_quantities(ensemble)->limit_words);
    kmp_json_put(&json, "hash_model %s hash_values %s hash_columns %s hash_equations %s", hashes[0], hashes[1],
                 hashes[2], hashes[3]);
    if (whole)
        kmp_json_put(&json, "hash %s", whole);
    kmp_json_put(&json, "}");
}

kempe_status kmp_manifest_put(kempe_ensemble *ensemble, const kempe_run_options *run, int lanes, int chunk,
                              const char *history, kmp_text *text)
{
    const kempe_model *model = kmp_ensemble_model(ensemble);
    hash hashes[4], whole;
    kmp_run_spec spec;
    kmp_arena arena = {0};
    kmp_text first = {0};
    KMP_TRY(kmp_manifest_hash_model(model, hashes[0]));
    hash_values(kmp_ensemble_values(ensemble), hashes[1]);
    KMP_TRY(hash_columns(ensemble, hashes[2]));
    KMP_TRY(hash_equations(kmp_ensemble_equations(ensemble), hashes[3]));
    kempe_status status = kmp_spec_of(kmp_ensemble_equations(ensemble), run, &arena, &spec);
    if (status == KEMPE_OK) {
        kempe_run_options resolved = *run;
        kmp_spec_numbers(&spec, &resolved);
        put_members(&first, ensemble, &resolved, lanes, chunk, history, hashes, NULL);
        kmp_manifest_hash_text(first.failed ? "" : first.s, whole);
        put_members(text, ensemble, &resolved, lanes, chunk, history, hashes, whole);
        status = kmp_made(model->context, !first.failed && !text->failed);
    }
    kmp_text_free(&first);
    kmp_arena_free(&arena);
    return status;
}

/* -- reading ----------------------------------------------------------------------------------------- */

/* The value of a key as it is written, up to the end of its line; NULL: there is none. */
static const char *raw_value(const char *manifest, const char *key, size_t *length)
{
    size_t size = strlen(key);
    for (const char *line = manifest; line; line = strchr(line, '\n')) {
        line += *line == '\n';
        if (strncmp(line, "  \"", 3) != 0 || strncmp(line + 3, key, size) != 0 ||
            strncmp(line + 3 + size, "\": ", 3) != 0)
            continue;
        const char *value = line + 6 + size;
        *length = strcspn(value, "\n");
        *length -= *length > 0 && value[*length - 1] == ',';
        return value;
    }
    return NULL;
}

/* The character that an escape of kmp_text_quote means; *s: behind its backslash, moved past it. */
static char unescaped(const char **s)
{
    char c = *(*s)++;
    if (c == 'n')
        return '\n';
    if (c == 't')
        return '\t';
    if (c != 'u')
        return c;
    char digits[5] = "";
    for (int k = 0; k < 4 && **s; k++)
        digits[k] = *(*s)++;
    return (char)strtol(digits, NULL, 16);
}

bool kmp_manifest_text(const char *manifest, const char *key, kmp_text *value)
{
    size_t length;
    const char *s = raw_value(manifest, key, &length), *end = s ? s + length : NULL;
    if (!s || length < 2 || *s != '"' || end[-1] != '"')
        return false;
    kmp_text_put(value, "");
    for (s++; s < end - 1;) {
        char c = *s++;
        if (c == '\\')
            c = unescaped(&s);
        kmp_text_append(value, &c, 1);
    }
    return !value->failed;
}

static bool manifest_double(const char *manifest, const char *key, double *value)
{
    size_t length;
    const char *s = raw_value(manifest, key, &length);
    bool negative = s && *s == '-';
    if (!s || kmp_text_to_number(s + negative, value) == 0)
        return false;
    *value = negative ? -*value : *value;
    return true;
}

bool kmp_manifest_int(const char *manifest, const char *key, int low, int high, int *value)
{
    double x;
    if (!manifest_double(manifest, key, &x) || !(x >= low && x <= high) || x != (double)(int)x)
        return false;
    *value = (int)x;
    return true;
}

kempe_status kmp_manifest_read(kempe_context *context, const char *folder, char **text)
{
    kmp_text path = {0};
    size_t length;
    *text = NULL;
    kmp_folder_put_manifest(&path, folder);
    kempe_status status = kmp_made(context, !path.failed);
    if (status == KEMPE_OK && (access(path.s, F_OK) == 0 || errno != ENOENT))
        status = kmp_file_read(context, KMP_FILE_RECORD, path.s, text, &length);
    kmp_text_free(&path);
    return status;
}

/* -- comparison -------------------------------------------------------------------------------------- */

/* Keys in the order of messages, and those of hashes in words. */
static const struct {
    const char *key, *words;
} compared[] = {{"format", NULL},
                {"kempe", "the version of Kempe"},
                {"model", "the name of the model"},
                {"instances", "the number of instances"},
                {"chunk", "the number of instances of a part"},
                {"values", "the kind of values"},
                {"sample", "the sample"},
                {"correlations", "the correlations"},
                {"design", "the design"},
                {"seed", "the seed"},
#define KMP_RUN_OPTION(name, type, key, engine, folder, ...) KMP_RUN_IF_FOLDER_##folder({#name, NULL}, )
#include "model/data/run_options.def"
#undef KMP_RUN_OPTION
                {"convergence_check", "the convergence check"},
                {"separate_runs", "the choice of separate runs"},
                {"history", "the list of histories"},
                {"output_step", "the time between rows of histories"},
                {"quantities", "the list of quantities"},
                {"limits", "the list of limits"},
                {"hash_model", "the content of the model (its file, a file that it includes, or --set)"},
                {"hash_values", "the content of the values"},
                {"hash_columns", "the list of columns"},
                {"hash_equations", "the derived equations (another build of Kempe)"},
                {"hash", "the hash of the manifest"}};

bool kmp_manifest_same(const char *there, const char *here, kmp_text *why)
{
    for (size_t k = 0; k < sizeof compared / sizeof *compared; k++) {
        size_t a = 0, b = 0;
        const char *key = compared[k].key, *words = compared[k].words ? compared[k].words : key;
        const char *x = raw_value(there, key, &a), *y = raw_value(here, key, &b);
        if (a == b && (!x) == (!y) && (!x || strncmp(x, y, a) == 0))
            continue;
        if (strncmp(key, "hash", 4) == 0)
            kmp_text_printf(why, "%s differs from that of the results in the folder", words);
        else
            kmp_text_printf(why, "%s is %.*s in the folder and %.*s in this run", words, x ? (int)a : 7,
                            x ? x : "missing", y ? (int)b : 7, y ? y : "missing");
        return false;
    }
    return true;
}

/* -- the folder --------------------------------------------------------------------------------------------- */

#define PART    "%s/part-%06d.parquet"
#define HISTORY "%s/history/part-%06d.parquet"

enum { LEAST_CHUNK = 256, MOST_CHUNK = 4096, USUAL_PARTS = 64 };

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

/* True if a file is there; length: that of its path, which was written to a buffer of PATH_MAX. */
static bool has_file(const char *path, int length)
{
    struct stat about;
    return length > 0 && length < PATH_MAX && stat(path, &about) == 0 && S_ISREG(about.st_mode) && about.st_size > 0;
}

bool kmp_folder_wants_history(const kempe_folder *f, int part)
{
    return kmp_instance_ranges_meet(&f->ranges, part * f->chunk, kmp_folder_part_size(f, part));
}

bool kmp_folder_has_part(const kempe_folder *f, int part)
{
    char path[PATH_MAX];
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
    (void)manifest_double(f->manifest, key, number);
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
    /* The hash written in a manifest must be that of its own text. */
    hash whole;
    kmp_manifest_hash_text(f->manifest, whole);
    if (strcmp(f->hash, whole) != 0)
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
    f->shape = f->measured = NULL;
    f->statistics = NULL;
}

void kempe_folder_free(kempe_folder *f)
{
    if (!f)
        return;
    kmp_folder_clear(f);
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

static void put_run(kmp_text *text, const kempe_folder *f)
{
    const kmp_batch_totals *t = &f->totals;
    double rate = f->wall_s > 0 ? (double)f->totals.sums.count / f->wall_s : 0;
    kmp_text_printf(text, "this run  %d part%s, %ld instance%s: %ld complete, %ld stopped, %ld failed\n", f->ran_parts,
                    plural(f->ran_parts), f->totals.sums.count, plural(f->totals.sums.count), t->sums.ok,
                    t->sums.stopped, t->sums.failed);
    if (f->totals.sums.count == 0)
        return;
    kmp_text_printf(text, "lanes     %ld instance%s separately\n", t->alone, plural(t->alone));
    kmp_text_printf(text, "closure   |h| %.3g, |hdot| %.3g at the end (worst, scaled by the characteristic length)\n",
                    t->sums.h, t->sums.hdot);
    kmp_text_printf(text, "energy    relative drift %.3g (worst)\n", t->sums.drift);
    if (t->sums.not_converged > 0)
        kmp_text_printf(text, "repeat    %ld instance%s NOT CONVERGED at another rtol\n", t->sums.not_converged,
                        t->sums.not_converged == 1 ? " HAS" : "s HAVE");
    kmp_text_printf(text, "cpu       %.3f s of %d thread%s, %.2f us per instance\n", t->cpu_s, t->threads,
                    plural(t->threads), 1e6 * t->cpu_s / (double)f->totals.sums.count);
    kmp_text_printf(text, "time      %.3f s, %.4g instances per second\n", f->wall_s, rate);
}

/* The next command. */
static void put_next(kmp_text *text, const kempe_folder *f)
{
    int missing = f->parts - f->whole;
    if (missing == 0) {
        kmp_text_put(text, "complete  kempe gather ");
        kmp_text_shell(text, f->path);
        kmp_text_put(text, " -o FILE.csv: checks the parts and writes one table\n");
        return;
    }
    kmp_text_printf(text, "missing   %d of %d part%s", missing, f->parts, plural(f->parts));
    if (f->elsewhere > 0)
        kmp_text_printf(text, "; other processes work on %d of them", f->elsewhere);
    kmp_text_put(text, "; the run's command with --resume runs them\n");
}

/* A run judges its own parts; those that were there before it are judged by a check. */
static const char *word_of(const kempe_folder *f)
{
    const kmp_instance_sums *sums = &f->totals.sums;
    if (f->interrupted || (f->checked && (f->whole < f->parts || f->damaged > 0)))
        return kmp_status_word(f->interrupted ? KEMPE_STOPPED : KEMPE_E_FAILED);
    if (!f->ran && f->failed > 0 && f->ok + f->distrusted == 0)
        return kmp_status_word(KEMPE_E_FAILED);
    if (!f->ran)
        return kmp_checked_word(f->stopped + f->failed + f->distrusted > 0 ? KEMPE_UNTRUSTED : KEMPE_OK,
                                f->repeated > 0);
    bool right = sums->ok == sums->count && sums->not_converged == 0;
    return right ? kmp_checked_word(f->doubted ? KEMPE_UNTRUSTED : KEMPE_OK,
                                    sums->repeated > 0 && f->ran_parts == f->whole)
                 : kmp_instances_word(sums);
}

static void put_text(kmp_text *text, const void *result)
{
    const kempe_folder *f = result;
    double rtol = 0, atol = 0, t_end = 0;
    (void)(manifest_double(f->manifest, "rtol", &rtol) && manifest_double(f->manifest, "atol", &atol) &&
           manifest_double(f->manifest, "t_end", &t_end));
    kmp_text_printf(text, "%s: %s, %d instance%s in %d part%s of %d; %d part%s whole in %s%s\n\n", f->model, word_of(f),
                    f->instances, plural(f->instances), f->parts, plural(f->parts), f->chunk, f->whole,
                    f->whole == 1 ? " is" : "s are", f->path, f->interrupted ? "; interrupted" : "");
    kmp_text_printf(text, "run       to t = %g s, rtol %g, atol %g\n", t_end, rtol, atol);
    if (f->ran)
        put_run(text, f);
    if (f->checked)
        kmp_text_printf(text, "status    %ld complete, %ld stopped, %ld failed\nparts     %d checked, %d damaged\n",
                        f->ok, f->stopped, f->failed, f->whole, f->damaged);
    if (f->history)
        kmp_text_printf(text, "history   of instances %s in %s/history\n", f->history, f->path);
    put_next(text, f);
    /* The statistics of a checked folder that has quantities. */
    char *said = NULL;
    if (!f->statistics)
        return;
    text->failed = text->failed || kempe_statistics_print(f->statistics, KEMPE_TEXT, &said) != KEMPE_OK;
    kmp_text_printf(text, "\n%s", said ? said : "");
    kempe_text_free(said);
}

static void put_json(kmp_text *text, const void *result)
{
    const kempe_folder *f = result;
    kmp_json json = kmp_json_begin(text);
    kmp_json_put(&json, "{ model %s status %s reason %s build_s %g", f->model, word_of(f),
                 f->interrupted ? "interrupted" : "", (double)NAN);
    kmp_json_put(&json, "folder %s hash %s instances %d parts %d chunk %d whole %d missing %d", f->path, f->hash,
                 f->instances, f->parts, f->chunk, f->whole, f->parts - f->whole);
    if (f->history)
        kmp_json_put(&json, "history %s", f->history);
    if (f->checked)
        kmp_json_put(&json, "damaged %d complete %ld stopped %ld failed %ld", f->damaged, f->ok, f->stopped, f->failed);
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
