/* SPDX-License-Identifier: BSD-3-Clause */
#include "model/change_points.h"
#include <string.h>

static const char *const words[KMP_CHANGE_POINTS_COUNT] = {
#define KMP_CHANGE_POINTS(id, word) word,
#include "model/change_points.def"
#undef KMP_CHANGE_POINTS
};

const char *kmp_change_points_word(kmp_change_points what)
{
    return words[what];
}

kmp_change_points kmp_change_points_find(const char *word, kmp_text *complaint)
{
    kmp_nearest nearest = kmp_nearest_begin(word);
    for (int k = 0; k < KMP_CHANGE_POINTS_COUNT; k++) {
        if (strcmp(words[k], word) == 0)
            return (kmp_change_points)k;
        kmp_nearest_offer(&nearest, words[k]);
    }
    kmp_text_printf(complaint, "change points '%s' is no way to take them; there is:", word);
    for (int k = 0; k < KMP_CHANGE_POINTS_COUNT; k++)
        kmp_text_printf(complaint, "%s %s", k ? "," : "", words[k]);
    kmp_nearest_suggest(&nearest, complaint);
    return KMP_CHANGE_POINTS_COUNT;
}
