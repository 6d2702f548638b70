/* SPDX-License-Identifier: BSD-3-Clause */
/* Meshes of finite elements with their matrices: arrays as a ZIP archive, or as files .npy of which the target makes
 * one with right checksums; Matrix Market, a text that begins with %%; or CalculiX. Further files follow
 * (memory_files.c). A mesh that is reduced has positive frequencies. */
#include "base/context.h"
#include "fuzz.h"
#include "output/zip_archive.h"
#include <kempe/reduce.h>

static void use(kempe_reduction *made)
{
    char *text = NULL;
    for (int k = 0; k < kempe_reduction_mode_count(made); k++)
        fuzz_promise(kempe_reduction_frequency(made, k) > 0, "modes are elastic");
    fuzz_promise(kempe_reduction_print(made, KEMPE_TEXT, &text) == KEMPE_OK && text, "a report");
    kempe_text_free(text);
    text = NULL;
    fuzz_promise(kempe_reduction_print(made, KEMPE_JSON, &text) == KEMPE_OK && fuzz_is_json(text), "JSON");
    kempe_text_free(text);
}

/* The first array is `nodes`, a line "#== NAME" begins each other one. */
static kmp_text archive_of(const uint8_t *data, size_t size)
{
    static const char mark[] = "\n#== ";
    kmp_zip zip = {.wide = true};
    char name[64] = "nodes";
    for (size_t from = 0; from < size;) {
        size_t end = from;
        while (end < size && (size - end < sizeof mark - 1 || memcmp(data + end, mark, sizeof mark - 1) != 0))
            end++;
        kmp_zip_add(&zip, name, (const char *)data + from, end - from);
        from = end < size ? end + sizeof mark - 1 : size;
        size_t length = 0;
        for (; from < size && data[from] != '\n'; from++)
            if (length < sizeof name - 1 && data[from])
                name[length++] = (char)data[from];
        name[length] = '\0';
        from++;
    }
    return kmp_zip_end(&zip);
}

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size)
{
    static kempe_context *context;
    const bool market = size > 2 && data[0] == '%' && data[1] == '%', loose = size > 2 && data[0] == 0x93;
    const bool arrays = loose || (size > 2 && data[0] == 'P');
    const kempe_reduce_options options = {.interfaces = "a=x=0",
                                          .modes = 1,
                                          .units = arrays ? NULL : "mm t s",
                                          .mass = market ? "M.mtx" : NULL,
                                          .nodes = market ? "nodes.txt" : NULL};
    const char *path = arrays ? "mesh.npz" : market ? "K.mtx" : "job.sti";
    kempe_reduction *made = NULL;
    if (!context)
        context = fuzz_context_new();
    kmp_text archive = loose ? archive_of(data, size) : (kmp_text){0};
    if (loose)
        fuzz_files_set(path, (const uint8_t *)archive.s, archive.length);
    else
        fuzz_files_set(path, data, size);
    kempe_status status = kempe_reduction_new(context, path, &options, &made);
    if (status != KEMPE_E_ARGUMENT && status != KEMPE_E_IO)
        fuzz_check_sentence(context, status);
    fuzz_promise((status == KEMPE_OK) == (made != NULL), "a body, or none");
    if (made)
        use(made);
    kempe_reduction_free(made);
    fuzz_files_clear();
    kmp_text_free(&archive);
    return 0;
}
