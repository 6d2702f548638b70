/* SPDX-License-Identifier: BSD-3-Clause */
/* The known word nearest to a misspelt one: begin, offer every known word, then read the result. */
#ifndef KMP_MODEL_TABLES_NEAREST_H
#define KMP_MODEL_TABLES_NEAREST_H

#include "base/text.h"

typedef struct kmp_nearest {
    const char *word, *best;
    int distance; /* of best; one more than the largest accepted distance when there is none */
} kmp_nearest;

kmp_nearest kmp_nearest_begin(const char *word);
void kmp_nearest_offer(kmp_nearest *nearest, const char *known);

/** Appends "; did you mean 'best'?", or nothing. */
void kmp_nearest_suggest(const kmp_nearest *nearest, kmp_text *sentence);

#endif
