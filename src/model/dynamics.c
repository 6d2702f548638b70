/* SPDX-License-Identifier: BSD-3-Clause */
#include "model/dynamics.h"
#include <string.h>

static const char *const words[KMP_DYNAMICS_COUNT] = {
#define KMP_DYNAMICS(id, word) word,
#include "model/dynamics.def"
#undef KMP_DYNAMICS
};

const char *kmp_dynamics_word(kmp_dynamics dynamics)
{
    return words[dynamics];
}

kmp_dynamics kmp_dynamics_find(const char *word, kmp_text *complaint)
{
    kmp_nearest nearest = kmp_nearest_begin(word);
    for (int k = 0; k < KMP_DYNAMICS_COUNT; k++) {
        if (strcmp(words[k], word) == 0)
            return (kmp_dynamics)k;
        kmp_nearest_offer(&nearest, words[k]);
    }
    kmp_text_printf(complaint, "dynamics '%s' is unknown; there is:", word);
    for (int k = 0; k < KMP_DYNAMICS_COUNT; k++)
        kmp_text_printf(complaint, "%s %s", k ? "," : "", words[k]);
    kmp_nearest_suggest(&nearest, complaint);
    return KMP_DYNAMICS_COUNT;
}
