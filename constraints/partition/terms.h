/* SPDX-License-Identifier: BSD-3-Clause */
/* Lists of the terms of sums, made once, so that loops need not look for zeros. */
#pragma once

#include "base/arena.h"

/* Sums: number k is made of value[from[e]] times row at[e], for e from start[k] to before start[k + 1]. */
typedef struct kmp_terms {
    int *start, *at, *from;
} kmp_terms;

/** Makes room for `sums` sums, with at most `most` terms in all. false: no memory. */
static inline bool kmp_terms_make(kmp_arena *arena, int sums, int most, kmp_terms *terms)
{
    return KMP_ARENA_MAKE(arena, KMP_ROOM(int, sums + 1, &terms->start),
                          KMP_ROOM(int, most + 1, &terms->at, &terms->from));
}

static inline void kmp_terms_begin(kmp_terms *terms, int k)
{
    terms->start[k + 1] = terms->start[k];
}

/** Adds a term to sum k, which has begun last. */
static inline void kmp_terms_add(kmp_terms *terms, int k, int at, int from)
{
    const int e = terms->start[k + 1]++;
    terms->at[e] = at;
    terms->from[e] = from;
}
