/* SPDX-License-Identifier: BSD-3-Clause */
/* A path from 0 to 1 in parts: all at once if possible, half as much after a failed part, twice as much after a
 * successful one.
 *
 *     kmp_adaptive_substeps way = KMP_PARTS;
 *     while (kmp_substeps_next(&way, 1e-7))
 *         kmp_substeps_take(&way, go_to(way.next));
 *     if (way.done < 1) ...
 */
#pragma once

#include <stdbool.h>

typedef struct kmp_adaptive_substeps {
    double done, part, next;
} kmp_adaptive_substeps;

#define KMP_PARTS ((kmp_adaptive_substeps){0, 1, 0})

/** Sets way->next, the end of the next part. False if the path is done, or parts have become shorter than `least`. */
static inline bool kmp_substeps_next(kmp_adaptive_substeps *parts, double least)
{
    double next = parts->done + parts->part;
    parts->next = next >= 1 - least ? 1 : next;
    return parts->done < 1 && parts->part >= least;
}

static inline void kmp_substeps_take(kmp_adaptive_substeps *parts, bool reached)
{
    parts->done = reached ? parts->next : parts->done;
    parts->part *= reached ? 2 : 0.5;
}
