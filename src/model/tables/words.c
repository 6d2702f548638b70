/* SPDX-License-Identifier: BSD-3-Clause */
#include "model/tables/words.h"
#include <string.h>

int kmp_word_find(const char *word, const char *const *words, int count, const char *kind, kmp_text *complaint)
{
    kmp_nearest nearest = kmp_nearest_begin(word);
    for (int k = 0; k < count; k++) {
        if (strcmp(words[k], word) == 0)
            return k;
        kmp_nearest_offer(&nearest, words[k]);
    }
    kmp_text_printf(complaint, "unknown %s '%s'; available:", kind, word);
    for (int k = 0; k < count; k++)
        kmp_text_printf(complaint, "%s %s", k ? "," : "", words[k]);
    kmp_nearest_suggest(&nearest, complaint);
    return count;
}
