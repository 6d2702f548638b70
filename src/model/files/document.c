/* SPDX-License-Identifier: BSD-3-Clause */
#include "model/files/document.h"
#include "model/formats/formats.h"

kempe_status kmp_document_load(kempe_context *context, kmp_arena *arena, const char *file, int number, const char *text,
                               size_t length, kmp_base base, const kmp_yaml **root)
{
    return kmp_is_foreign(file, text, length) ? kmp_foreign_load(context, arena, file, number, text, length, base, root)
                                              : kmp_yaml_load(context, arena, file, number, text, length, root);
}
