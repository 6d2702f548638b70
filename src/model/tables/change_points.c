/* SPDX-License-Identifier: BSD-3-Clause */
#include "model/tables/change_points.h"
#include "model/tables/words.h"

static const char *const words[KMP_CHANGE_POINTS_COUNT] = {
#define KMP_CHANGE_POINTS(id, word) word,
#include "model/tables/change_points.def"
#undef KMP_CHANGE_POINTS
};

const char *kmp_change_points_word(kmp_change_points what)
{
    return words[what];
}

kmp_change_points kmp_change_points_find(const char *word, kmp_text *complaint)
{
    return (kmp_change_points)kmp_word_find(word, words, KMP_CHANGE_POINTS_COUNT, "value of change_points", complaint);
}
