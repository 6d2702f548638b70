/* SPDX-License-Identifier: BSD-3-Clause */
#include "model/files/document.h"
#include <string.h>

static bool ends_with(const char *name, const char *ending)
{
    size_t length = strlen(name), tail = strlen(ending);
    return length > tail && strcmp(name + length - tail, ending) == 0;
}

/* No model in YAML begins with this sign. */
static bool is_xml(const char *text, size_t length)
{
    static const char mark[] = "\xef\xbb\xbf"; /* of UTF-8 */
    size_t at = length >= 3 && memcmp(text, mark, 3) == 0 ? 3 : 0;
    while (at < length && strchr(" \t\r\n", text[at]) && text[at])
        at++;
    return at < length && text[at] == '<';
}

kempe_status kmp_document_load(kempe_context *context, kmp_arena *arena, const char *file, int number, const char *text,
                               size_t length, const kmp_yaml **root)
{
    bool mbs = ends_with(file, ".mbs") || is_xml(text, length);
    return (mbs ? kmp_mbs_load : kmp_yaml_load)(context, arena, file, number, text, length, root);
}
