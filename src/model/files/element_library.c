/* SPDX-License-Identifier: BSD-3-Clause */
/* Elements are text within the library, so that every command, program and package has them wherever it is. */
#include "model/files/element_library.h"
#include "base/text.h"
#include "model/language/nearest.h"
#include <kempe/kempe.h>
#include <string.h>

static const char scheme[] = "kempe:";

bool kmp_is_element(const char *path)
{
    return strncmp(path, scheme, sizeof scheme - 1) == 0;
}

static kempe_status refuse(kempe_context *context, const char *path)
{
    kmp_nearest nearest = kmp_nearest_begin(path);
    kmp_text sentence = {0};
    for (const kmp_machine_element *e = kmp_elements; e->name; e++)
        kmp_nearest_offer(&nearest, e->name);
    kmp_text_printf(&sentence, "cannot read '%s': the library has no element of this name", path);
    kmp_nearest_suggest(&nearest, &sentence);
    if (!nearest.best)
        kmp_text_put(&sentence, "; their names are kempe:NAME.yaml");
    return kmp_fail_text(context, KEMPE_E_IO, &sentence);
}

kempe_status kmp_element_read(kempe_context *context, const char *path, char **text, size_t *length)
{
    const kmp_machine_element *element = kmp_elements;
    kmp_text all = {0};
    while (element->name && strcmp(element->name, path) != 0)
        element++;
    if (!element->name)
        return refuse(context, path);
    for (int k = 0; element->lines[k]; k++)
        kmp_text_put(&all, element->lines[k]);
    *length = all.length;
    *text = kmp_text_take(&all);
    return kmp_made(context, *text);
}

int kempe_element_count(void)
{
    int count = 0;
    while (kmp_elements[count].name)
        count++;
    return count;
}

const char *kempe_element_name(int k)
{
    return k >= 0 && k < kempe_element_count() ? kmp_elements[k].name : "";
}

kempe_status kempe_element_text(kempe_context *context, const char *name, char **text)
{
    size_t length;
    KMP_WANTED(NULL, context, "context");
    KMP_WANTED(context, name, "name");
    KMP_WANTED(context, text, "text");
    kmp_context_begin(context);
    return kmp_element_read(context, name, text, &length);
}
