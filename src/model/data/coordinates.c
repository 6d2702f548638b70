/* SPDX-License-Identifier: BSD-3-Clause */
#include "model/data/coordinates.h"
#include "model/data/model.h"
#include "model/language/nearest.h"
#include <string.h>

kempe_status kmp_coordinate_find(const kempe_model *model, const char *what, const char *name, size_t length,
                                 int *coordinate)
{
    kmp_arena arena = {0};
    kmp_text hint = {0};
    for (; length > 0 && strchr(" \t", *name); length--)
        name++;
    while (length > 0 && strchr(" \t", name[length - 1]))
        length--;
    const char *word = kmp_arena_printf(&arena, "%.*s", (int)length, name);
    KMP_TRY(kmp_made(model->context, word));
    kempe_status status = KEMPE_OK;
    int found = kmp_name_find(KMP_COORDINATES(model), word);
    kmp_nearest nearest = kmp_nearest_of(word, KMP_COORDINATES(model));
    if (found >= 0)
        *coordinate = found;
    else if (kmp_name_find(KMP_NAMED(model, cut), word) >= 0)
        kmp_text_put(&hint, ": the joint is cut (cut: no in the model keeps it)");
    else
        kmp_nearest_suggest(&nearest, &hint);
    if (found < 0)
        status = kmp_fail(model->context, KEMPE_E_ARGUMENT, "%s: unknown coordinate '%s'%s", what, word,
                          hint.s ? hint.s : "");
    kmp_text_free(&hint);
    kmp_arena_free(&arena);
    return status;
}

kempe_status kmp_coordinates_read(const kempe_model *model, const char *what, const char *text, int *list, int *count)
{
    *count = 0;
    for (const char *s = text; s && *s;) {
        size_t length = strcspn(s, ",");
        int k = -1;
        KMP_TRY(kmp_coordinate_find(model, what, s, length, &k));
        for (int i = 0; i < *count; i++)
            if (list[i] == k)
                return kmp_fail(model->context, KEMPE_E_ARGUMENT, "%s: coordinate '%s' is given twice", what,
                                model->motions[k].name);
        list[(*count)++] = k;
        s += length + (s[length] == ',');
    }
    return KEMPE_OK;
}
