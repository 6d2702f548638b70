/* SPDX-License-Identifier: BSD-3-Clause */
#include "model/files/document.h"
#include "base/wings.h"

static const kmp_document_wing *wing_for(const char *file, const char *text, size_t length)
{
    for (const kmp_wing *const *wing = kmp_wings; *wing; wing++)
        if ((*wing)->documents && (*wing)->documents->is_foreign(file, text, length))
            return (*wing)->documents;
    return NULL;
}

bool kmp_document_is_foreign(const char *file, const char *text, size_t length)
{
    return wing_for(file, text, length) != NULL;
}

kempe_status kmp_document_load(kempe_context *context, kmp_arena *arena, const char *file, int number, const char *text,
                               size_t length, kmp_base base, const kmp_include_files *beside, const kmp_yaml **root)
{
    const kmp_document_wing *foreign = wing_for(file, text, length);
    if (foreign)
        return foreign->load(context, arena, file, number, text, length, base, beside, root);
    if (length > 0 && *text == '<')
        return kmp_fail(context, KEMPE_E_INPUT,
                        "%s:1:1: a model of another program: this build of Kempe reads none; configure it with "
                        "-DKEMPE_EXCHANGE=ON",
                        file);
    kempe_status status = kmp_yaml_load(context, arena, file, number, text, length, root);
    for (const kmp_wing *const *wing = kmp_wings; *wing && status == KEMPE_OK && *root; wing++)
        if ((*wing)->documents)
            status = (*wing)->documents->convert(context, arena, file, base, beside, root);
    return status;
}
