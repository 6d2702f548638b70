/* SPDX-License-Identifier: BSD-3-Clause */
/* The manifest of a result folder: a JSON object of plain members, one a line, each key once. It is written once and
 * compared line by line. Members of `apart` are not in its hash: they describe where things were, or are the hash. */
#include "ensemble/manifest.h"
#include "base/cache/digest.h"
#include "base/file.h"
#include "base/json.h"
#include "ensemble/result_folder.h"
#include "ensemble/sampling/values.h"
#include "model/data/model.h"
#include "platform/platform.h"
#include "studies/simulate/trajectory.h"
#include <errno.h>
#include <stdlib.h>
#include <string.h>

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
    if (model->source.has_digest) {
        kmp_digest_add_part(&digest, model->source.digest, sizeof model->source.digest);
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

static kempe_status hash_columns(kempe_ensemble *ensemble, hash out)
{
    kmp_digest digest;
    kempe_table *table = NULL;
    kempe_context *context = kmp_ensemble_model(ensemble)->context;
    const kmp_shown_in shown = kmp_context_show_in(context, (kmp_shown_in){0}); /* parts are in SI */
    kempe_status status = kmp_ensemble_columns(ensemble, &table);
    (void)kmp_context_show_in(context, shown);
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

static void put_text(kmp_json *json, const char *key, const char *text)
{
    kmp_json_string(json, key, text ? text : "");
}

static void put_run(kmp_json *json, const kempe_run_options *run)
{
#define PUT(value) _Generic(value, double : kmp_json_number, long : kmp_json_whole, const char * : put_text)
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
                 model->source.file);
    if (model->start.at)
        kmp_json_put(&json, "at %s", model->start.at);
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
    put_run(&json, run);
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
    /* Names, and the rows that are given or the options of the sample. */
    const kempe_values *values = kmp_ensemble_values(ensemble);
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
    end_hash(&digest, hashes[1]);
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

bool kmp_manifest_double(const char *manifest, const char *key, double *value)
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
    if (!kmp_manifest_double(manifest, key, &x) || !(x >= low && x <= high) || x != (double)(int)x)
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
    if (status == KEMPE_OK && (kmp_path_exists(path.s) || errno != ENOENT))
        status = kmp_file_read(context, KMP_FILE_RECORD, path.s, text, &length);
    kmp_text_free(&path);
    return status;
}

bool kmp_manifest_is_whole(const char *manifest, const char *written)
{
    hash whole;
    kmp_manifest_hash_text(manifest, whole);
    return strcmp(written, whole) == 0;
}

/* -- comparison -------------------------------------------------------------------------------------- */

/* Keys in the order of messages, and keys of hashes in words. */
static const struct {
    const char *key, *words;
} compared[] = {{"format", NULL},
                {"kempe", "the version of Kempe"},
                {"model", "the name of the model"},
                {"at", "the state at the start (--at)"},
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
                {"hash_model", "the content of the model (its file, a file that it includes, --set or --at)"},
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
            kmp_text_printf(why, "%s differs from the results in the folder", words);
        else
            kmp_text_printf(why, "%s is %.*s in the folder and %.*s in this run", words, x ? (int)a : 7,
                            x ? x : "missing", y ? (int)b : 7, y ? y : "missing");
        return false;
    }
    return true;
}
