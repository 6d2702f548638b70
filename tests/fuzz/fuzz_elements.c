/* SPDX-License-Identifier: BSD-3-Clause */
/* Meshes of finite elements with their matrices: arrays (bytes of a ZIP archive), Matrix Market (a text that begins
 * with
 * %%), or CalculiX; further files follow (memory_files.c). A mesh that is reduced has positive mass and frequencies. */
#include "base/context.h"
#include "fuzz.h"
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

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size)
{
    static kempe_context *context;
    const bool market = size > 2 && data[0] == '%' && data[1] == '%', arrays = size > 2 && data[0] == 'P';
    const kempe_reduce_options options = {.interfaces = "a=x=0",
                                          .modes = 1,
                                          .units = arrays ? NULL : "mm t s",
                                          .mass = market ? "M.mtx" : NULL,
                                          .nodes = market ? "nodes.txt" : NULL};
    const char *path = arrays ? "mesh.npz" : market ? "K.mtx" : "job.sti";
    kempe_reduction *made = NULL;
    if (!context)
        context = fuzz_context_new();
    fuzz_files_set(path, data, size);
    kempe_status status = kempe_reduction_new(context, path, &options, &made);
    if (status != KEMPE_E_ARGUMENT && status != KEMPE_E_IO)
        fuzz_check_sentence(context, status);
    fuzz_promise((status == KEMPE_OK) == (made != NULL), "a body, or none");
    if (made)
        use(made);
    kempe_reduction_free(made);
    fuzz_files_clear();
    return 0;
}
