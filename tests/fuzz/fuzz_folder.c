/* SPDX-License-Identifier: BSD-3-Clause */
/* Result folders: a manifest, and parts after lines `#== PLACE`. The hash of a manifest and the sums of parts are made
 * right, so that what is behind them is read too. A manifest with the word `damaged` is left as it is. */
#include "base/context.h"
#include "base/memory.h"
#include "ensemble/folder_parts.h"
#include "ensemble/manifest.h"
#include "ensemble/result_folder.h"
#include "fuzz.h"
#include "output/parquet.h"
#include <kempe/ensemble.h>

static const char mark[] = "\n#== ", hash_key[] = "  \"hash\": \"", sum_key[] = "kempe.sum";

typedef struct span {
    char *at;
    size_t size;
} span;

static char *find(span in, const char *word)
{
    size_t length = strlen(word);
    for (size_t k = 0; k + length <= in.size; k++)
        if (memcmp(in.at + k, word, length) == 0)
            return in.at + k;
    return NULL;
}

/* The hash that the manifest would have, in the place of the one that is written, which has as many digits. */
static void set_hash(span manifest, char hash[KMP_HASH_SIZE + 1])
{
    char *at = find(manifest, hash_key), *copy = kmp_calloc(manifest.size + 1, 1);
    fuzz_promise(copy, "there is memory");
    memcpy(copy, manifest.at, manifest.size);
    kmp_manifest_hash_text(copy, hash);
    kmp_free(copy);
    size_t before = at ? (size_t)(at - manifest.at) + strlen(hash_key) : manifest.size;
    if (before + KMP_HASH_SIZE <= manifest.size)
        memcpy(manifest.at + before, hash, KMP_HASH_SIZE);
}

/* In a part: the hash of the run after its key, then the sum of the bytes before its own key. */
static void set_sum(span part, const char *hash)
{
    char *run = find(part, "kempe.run"), *last = NULL;
    if (run && (size_t)(part.at + part.size - run) > 11 + KMP_HASH_SIZE)
        memcpy(run + 11, hash, KMP_HASH_SIZE);
    for (span rest = part; (rest.at = find(rest, sum_key));
         rest.at++, rest.size = (size_t)(part.at + part.size - rest.at)) {
        last = rest.at;
        rest.size = (size_t)(part.at + part.size - rest.at);
    }
    const size_t key = sizeof sum_key - 1;
    if (!last || (size_t)(part.at + part.size - last) < key + 2 + KMP_PARQUET_SUM)
        return;
    char sum[KMP_PARQUET_SUM + 1];
    kmp_parquet_sum(part.at, (size_t)(last + key - part.at), sum);
    memcpy(last + key + 2, sum, KMP_PARQUET_SUM);
}

static void mend(char *text, size_t size)
{
    char hash[KMP_HASH_SIZE + 1];
    char *next = find((span){text, size}, mark);
    span manifest = {text, next ? (size_t)(next - text) + 1 : size};
    if (find(manifest, "damaged"))
        return;
    set_hash(manifest, hash);
    while (next) {
        char *line = memchr(next + 1, '\n', (size_t)(text + size - next - 1));
        if (!line)
            return;
        span rest = {line, (size_t)(text + size - line)};
        next = find(rest, mark);
        set_sum((span){line + 1, next ? (size_t)(next - line) : rest.size - 1}, hash);
    }
}

static void print(const kempe_context *context, const kempe_folder *folder, kempe_format format)
{
    char *text = NULL;
    fuzz_check_sentence(context, kempe_folder_print(folder, format, &text));
    fuzz_promise(text && *text && (format != KEMPE_JSON || fuzz_is_json(text)), "what is printed can be read");
    kempe_text_free(text);
}

static void use(kempe_context *context, kempe_folder *folder)
{
    kempe_run_options run = {0};
    kempe_table *table = NULL;
    print(context, folder, KEMPE_TEXT);
    kempe_folder_run_options(folder, &run);
    kempe_status status = kempe_folder_check(folder);
    fuzz_check_sentence(context, status);
    print(context, folder, KEMPE_JSON);
    if (status < 0)
        return;
    fuzz_check_sentence(context, kmp_folder_table(folder, &table));
    kempe_table_free(table);
}

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size)
{
    static kempe_context *context;
    kempe_folder *folder = NULL;
    char *copy = kmp_calloc(size + 1, 1);
    fuzz_promise(copy, "there is memory");
    if (!context)
        context = fuzz_context_new();
    if (size > 0)
        memcpy(copy, data, size);
    mend(copy, size);
    fuzz_files_set("run.kempe/manifest.json", (const uint8_t *)copy, size);
    kempe_status status = kempe_folder_open(context, "run.kempe", &folder);
    fuzz_check_sentence(context, status);
    fuzz_promise((status == KEMPE_OK) == (folder != NULL), "a folder comes with KEMPE_OK, and only then");
    if (folder)
        use(context, folder);
    kempe_folder_free(folder);
    fuzz_files_clear();
    kmp_free(copy);
    return 0;
}
