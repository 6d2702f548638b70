/* SPDX-License-Identifier: BSD-3-Clause */
#include "model/tables/coordinates.h"
#include "model/tables/nearest.h"
#include <string.h>

static bool is_cut(const kempe_model *model, const char *joint)
{
    for (int k = 0; k < model->cut_count; k++)
        if (strcmp(model->cuts[k].joint, joint) == 0)
            return true;
    return false;
}

kempe_status kmp_coordinate_find(const kempe_model *model, const char *what, const char *name, size_t length,
                                 int *coordinate)
{
    kmp_text word = {0}, sentence = {0};
    for (; length > 0 && strchr(" \t", *name); length--)
        name++;
    while (length > 0 && strchr(" \t", name[length - 1]))
        length--;
    kmp_text_printf(&word, "%.*s", (int)length, name);
    if (word.failed)
        return kmp_fail_memory(model->context);
    kmp_nearest nearest = kmp_nearest_begin(word.s);
    int found = -1;
    for (int k = 0; k < model->motion_count && found < 0; k++) {
        kmp_nearest_offer(&nearest, model->motions[k].name);
        if (strcmp(model->motions[k].name, word.s) == 0)
            found = k;
    }
    kempe_status status = KEMPE_OK;
    if (found < 0) {
        if (is_cut(model, word.s))
            kmp_text_put(&sentence, ": the joint is cut (cut: no in the model keeps it)");
        else
            kmp_nearest_suggest(&nearest, &sentence);
        status = kmp_fail(model->context, KEMPE_E_ARGUMENT, "%s: unknown coordinate '%s'%s", what, word.s,
                          sentence.s ? sentence.s : "");
    } else {
        *coordinate = found;
    }
    kmp_text_free(&sentence);
    kmp_text_free(&word);
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
