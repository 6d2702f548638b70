/* SPDX-License-Identifier: BSD-3-Clause */
/* The model in the resources of a unit on the library: its files, in folders as they were. */
#include "exchange/fmu/unit_resources.h"
#include "base/context.h"
#include "base/file.h"
#include "base/memory.h"
#include "exchange/fmu/unit_parts.h"
#include "model/data/model.h"
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

static kempe_status add_bytes(kempe_context *context, kmp_code_files *files, const char *name, const char *bytes,
                              size_t length)
{
    kmp_text *text = kmp_code_add(files, "resources/%s", name);
    if (text)
        kmp_text_append(text, bytes, length);
    return kmp_made(context, text && !text->failed);
}

/* Whole paths of the files, and the length of the folder that all are in. */
static kempe_status find_files(const kempe_model *model, kmp_arena *arena, char **whole, size_t *common)
{
    for (int k = 0; k < model->path_count; k++) {
        char *path = realpath(model->paths[k], NULL);
        whole[k] = path ? kmp_arena_strdup(arena, path) : NULL;
        free(path);
        if (!whole[k])
            return kmp_fail(model->context, KEMPE_E_INPUT,
                            "the file '%s' of the model is not there: a unit on the library contains the model's files",
                            model->paths[k]);
        size_t same = 0;
        while (whole[0][same] && whole[0][same] == whole[k][same])
            same++;
        *common = k == 0 || same < *common ? same : *common;
    }
    while (*common > 0 && whole[0][*common - 1] != '/')
        --*common;
    return KEMPE_OK;
}

static kempe_status add_files(kmp_code_files *files, kmp_arena *arena, const kempe_model *model, const char **main_file)
{
    char **whole = KMP_ARENA_NEW(arena, char *, model->path_count);
    size_t common = 0, length = 0;
    KMP_TRY(kmp_made(model->context, whole));
    KMP_TRY(find_files(model, arena, whole, &common));
    for (int k = 0; k < model->path_count; k++) {
        char *text = NULL;
        const char *name = kmp_arena_printf(arena, "model/%s", whole[k] + common);
        KMP_TRY(kmp_made(model->context, name));
        KMP_TRY(kmp_file_read(model->context, KMP_FILE_INCLUDED, whole[k], &text, &length));
        kempe_status status = add_bytes(model->context, files, name, text, length);
        kmp_free(text);
        KMP_TRY(status);
    }
    *main_file = kmp_arena_printf(arena, "model/%s", whole[0] + common);
    return kmp_made(model->context, *main_file);
}

kempe_status kmp_unit_add_resources(kmp_code_files *files, kmp_arena *arena, const kempe_model *model)
{
    const char *main_file = "model/model.yaml";
    kmp_text list = {0};
    const bool has_file = model->path_count > 0 && access(model->paths[0], R_OK) == 0;
    if (model->document && !has_file) /* built in code, or read from a text */
        KMP_TRY(add_bytes(model->context, files, main_file, model->document, strlen(model->document)));
    else
        KMP_TRY(add_files(files, arena, model, &main_file));
    kmp_text_printf(&list, "%s\n", main_file);
    for (int k = 0; k < model->setting_count; k++)
        if (!strchr(model->settings[k].value, ':')) /* samples come from the importer */
            kmp_text_printf(&list, "%s=%s\n", model->settings[k].name, model->settings[k].value);
    kempe_status status = kmp_made(model->context, !list.failed);
    if (status == KEMPE_OK)
        status = add_bytes(model->context, files, KMP_UNIT_LIST, list.s, list.length);
    kmp_text_free(&list);
    return status;
}
