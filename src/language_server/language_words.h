/* SPDX-License-Identifier: BSD-3-Clause */
/* Words of the language itself: functions, measures, outputs and units, with a sentence for each. */
#pragma once

#include <stdbool.h>
#include <stddef.h>

typedef enum kmp_word_kind {
    KMP_WORD_FUNCTION,
    KMP_WORD_MEASURE,  /* in expressions */
    KMP_WORD_OUTPUT,   /* among the outputs of a run */
    KMP_WORD_VARIABLE, /* t, q(..), .. */
    KMP_WORD_UNIT
} kmp_word_kind;

typedef struct kmp_language_word {
    kmp_word_kind kind;
    const char *name;
    const char *form;    /* "atan2(a, b)" */
    const char *unit;    /* of a measure; "" */
    const char *meaning; /* "" */
    bool called;         /* parentheses follow */
} kmp_language_word;

/** The k-th word; false: there are no more. Some have several rows. */
bool kmp_language_word_at(int k, kmp_language_word *word);
