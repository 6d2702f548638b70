/* SPDX-License-Identifier: BSD-3-Clause */
/* The section `run` of a model, and what it shares with the options of runs: words for the algorithm of the dynamics,
 * for the treatment of change points and for the place of largest reactions, and the largest number of rows. */
#pragma once

#include "model/data/place.h"
#include "model/language/expression.h"
#include "model/language/nearest.h"
#include <kempe/kempe.h>

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

typedef enum kmp_reaction_peaks {
#define KMP_REACTION_PEAKS(id, word) KMP_REACTION_PEAKS_##id,
#include "model/data/reaction_peaks.def"
#undef KMP_REACTION_PEAKS
    KMP_REACTION_PEAKS_COUNT
} kmp_reaction_peaks;

/* The rows of run_options.def that are keys, 0 or NULL where not given: double t_end, long max_steps, const char *form,
 * kmp_change_points change_points, int *independent and its independent_count, .. */
typedef struct kmp_run_settings {
#define KMP_SETTING_KEY(name, type)    KMP_RUN_TYPE_##type name;
#define KMP_SETTING_NAMES(name, type)  int *name, name##_count;
#define KMP_SETTING_CHOICE(name, type) kmp_##name name;
#define KMP_SETTING_NO(name, type)
#define KMP_RUN_OPTION(name, type, key, ...) KMP_SETTING_##key(name, type)
#include "model/data/run_options.def"
#undef KMP_RUN_OPTION
#undef KMP_SETTING_KEY
#undef KMP_SETTING_NAMES
#undef KMP_SETTING_CHOICE
#undef KMP_SETTING_NO
    kmp_place every_place; /* of output_step */
    kmp_dynamics dynamics;
    const kmp_expr **until; /* comparisons: a run ends when a condition becomes true */
    int until_count;
    kmp_place until_place;
} kmp_run_settings;

extern const kmp_name_list kmp_dynamics_words, kmp_change_points_words, kmp_reaction_peaks_words;

const char *kmp_dynamics_word(kmp_dynamics dynamics);
const char *kmp_change_points_word(kmp_change_points what);
const char *kmp_reaction_peaks_word(kmp_reaction_peaks where);

/** The COUNT when no setting has that name. The message is appended to `complaint` then: the word, the valid words and
 * the nearest one. */
kmp_dynamics kmp_dynamics_find(const char *word, kmp_text *complaint);
kmp_change_points kmp_change_points_find(const char *word, kmp_text *complaint);
kmp_reaction_peaks kmp_reaction_peaks_find(const char *word, kmp_text *complaint);

enum { KMP_MOST_ROWS = 1000000 };

/** True if the number of rows at intervals of `every` seconds up to t_end is allowed. Otherwise `complaint` has the
 * message (it stays empty when there is no memory). */
bool kmp_rows_fit(double every, double t_end, kmp_text *complaint);

/** The section `run` of a model. */
const kmp_run_settings *kmp_model_run(const kempe_model *model);
