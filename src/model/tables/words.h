/* SPDX-License-Identifier: BSD-3-Clause */
/* Settings that are one word of a few, in models and as options. */
#ifndef KMP_MODEL_TABLES_WORDS_H
#define KMP_MODEL_TABLES_WORDS_H

#include "model/tables/nearest.h"

/** Index of a word among `count`; `count` when it is none of them. The message appended to `complaint` names the kind,
 * the word, the valid words and the nearest one. */
int kmp_word_find(const char *word, const char *const *words, int count, const char *kind, kmp_text *complaint);

#endif
