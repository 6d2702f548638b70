/* SPDX-License-Identifier: BSD-3-Clause */
/* Search in lists of names, and the known word nearest to a misspelt one. */
#pragma once

#include "base/arena.h"
#include "base/text.h"

/** Names of a list of words, or of objects whose first member is the name. */
typedef struct kmp_name_list {
    const void *list;
    size_t size; /* of one object */
    int count;
} kmp_name_list;

#define KMP_NAMES(list, count) ((kmp_name_list){(list), sizeof *(list), (count)})
#define KMP_NAMES_OF(array)    KMP_NAMES(array, (int)(sizeof(array) / sizeof *(array)))

const char *kmp_name_at(kmp_name_list names, int k);

/** The index of a name; -1: it is none of them. */
int kmp_name_find(kmp_name_list names, const char *name);

/** An index of names by hash, empty at first. Names that a list has got since the last look-up are taken up; those it
 * had stay what they are. */
typedef struct kmp_name_index {
    int *slots; /* number of a name, from 1 */
    size_t size;
    int held;
} kmp_name_index;

/** kmp_name_find by an index, which lives in the arena. Of objects with an int at `group_at` of them that counts as a
 * part of the name, the objects with this one; -1: they have none. */
int kmp_index_find(kmp_name_index *index, kmp_arena *arena, kmp_name_list names, ptrdiff_t group_at, int group,
                   const char *name);

/** The index of a word, `names.count` when it is none of them. The message appended to `complaint` names the kind, the
 * word, the valid words and the nearest one. */
int kmp_word_find(const char *word, kmp_name_list names, const char *kind, kmp_text *complaint);

/** The names with `between` between two of them, and `last` before the last one. */
void kmp_name_list_print(kmp_text *text, kmp_name_list names, const char *between, const char *last);

/** The nearest word: begin, offer every known word, then read the result. */
typedef struct kmp_nearest {
    const char *word, *best;
    int distance; /* of best; one more than the largest accepted distance when there is none */
} kmp_nearest;

kmp_nearest kmp_nearest_begin(const char *word);
void kmp_nearest_offer(kmp_nearest *nearest, const char *known);
kmp_nearest kmp_nearest_of(const char *word, kmp_name_list names);
void kmp_nearest_offer_all(kmp_nearest *nearest, kmp_name_list names);

/** Appends "; did you mean 'best'?", or nothing. */
void kmp_nearest_suggest(const kmp_nearest *nearest, kmp_text *sentence);
