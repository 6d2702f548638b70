/* SPDX-License-Identifier: BSD-3-Clause */
/* Settings of runs that models and options share: words for the algorithm of the dynamics and for the treatment of
 * change points, and the largest number of rows. */
#pragma once

#include "model/language/nearest.h"

typedef enum kmp_dynamics {
#define KMP_DYNAMICS(id, word) KMP_DYNAMICS_##id,
#include "model/data/dynamics.def"
#undef KMP_DYNAMICS
    KMP_DYNAMICS_COUNT
} kmp_dynamics;

typedef enum kmp_change_points {
#define KMP_CHANGE_POINTS(id, word) KMP_CHANGE_POINTS_##id,
#include "model/data/change_points.def"
#undef KMP_CHANGE_POINTS
    KMP_CHANGE_POINTS_COUNT
} kmp_change_points;

extern const kmp_name_list kmp_dynamics_words, kmp_change_points_words;

const char *kmp_dynamics_word(kmp_dynamics dynamics);
const char *kmp_change_points_word(kmp_change_points what);

/** The COUNT when no setting has that name. The message is appended to `complaint` then: the word, the valid words and
 * the nearest one. */
kmp_dynamics kmp_dynamics_find(const char *word, kmp_text *complaint);
kmp_change_points kmp_change_points_find(const char *word, kmp_text *complaint);

enum { KMP_MOST_ROWS = 1000000 };

/** True if the number of rows at intervals of `every` seconds up to t_end is allowed. Otherwise `complaint` has the
 * message (it stays empty when there is no memory). */
bool kmp_rows_fit(double every, double t_end, kmp_text *complaint);
