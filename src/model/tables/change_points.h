/* SPDX-License-Identifier: BSD-3-Clause */
/* The words for the treatment of change points in a run. */
#ifndef KMP_MODEL_TABLES_CHANGE_POINTS_H
#define KMP_MODEL_TABLES_CHANGE_POINTS_H

#include "model/tables/nearest.h"

typedef enum kmp_change_points {
#define KMP_CHANGE_POINTS(id, word) KMP_CHANGE_POINTS_##id,
#include "model/tables/change_points.def"
#undef KMP_CHANGE_POINTS
    KMP_CHANGE_POINTS_COUNT
} kmp_change_points;

const char *kmp_change_points_word(kmp_change_points what);

/** KMP_CHANGE_POINTS_COUNT when no treatment has that name. The message is appended to `complaint` then: the word, the
 * valid words and the nearest one. */
kmp_change_points kmp_change_points_find(const char *word, kmp_text *complaint);

#endif
