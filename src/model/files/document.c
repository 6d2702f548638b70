/* SPDX-License-Identifier: BSD-3-Clause */
#include "model/files/document.h"
#include "exchange/formats/formats.h"

kempe_status kmp_document_load(kempe_context *context, kmp_arena *arena, const char *file, int number, const char *text,
                               size_t length, kmp_base base, const kmp_include_files *beside, const kmp_yaml **root)
{
    if (kmp_is_foreign(file, text, length))
        return kmp_foreign_load(context, arena, file, number, text, length, base, beside, root);
    kempe_status status = kmp_yaml_load(context, arena, file, number, text, length, root);
    return status == KEMPE_OK && *root ? kmp_foreign_convert(context, arena, file, base, beside, root) : status;
}
