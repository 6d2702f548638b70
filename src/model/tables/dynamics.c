/* SPDX-License-Identifier: BSD-3-Clause */
#include "model/tables/dynamics.h"
#include "model/tables/words.h"

static const char *const words[KMP_DYNAMICS_COUNT] = {
#define KMP_DYNAMICS(id, word) word,
#include "model/tables/dynamics.def"
#undef KMP_DYNAMICS
};

const char *kmp_dynamics_word(kmp_dynamics dynamics)
{
    return words[dynamics];
}

kmp_dynamics kmp_dynamics_find(const char *word, kmp_text *complaint)
{
    return (kmp_dynamics)kmp_word_find(word, words, KMP_DYNAMICS_COUNT, "algorithm", complaint);
}
