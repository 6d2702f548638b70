/* SPDX-License-Identifier: BSD-3-Clause */
#include "model/data/run_settings.h"
#include "model/data/model.h"

static const char *const dynamics_words[KMP_DYNAMICS_COUNT] = {
#define KMP_DYNAMICS(id, word) word,
#include "model/data/dynamics.def"
#undef KMP_DYNAMICS
};

static const char *const change_points_words[KMP_CHANGE_POINTS_COUNT] = {
#define KMP_CHANGE_POINTS(id, word) word,
#include "model/data/change_points.def"
#undef KMP_CHANGE_POINTS
};

static const char *const reaction_peaks_words[KMP_REACTION_PEAKS_COUNT] = {
#define KMP_REACTION_PEAKS(id, word) word,
#include "model/data/reaction_peaks.def"
#undef KMP_REACTION_PEAKS
};

const kmp_name_list kmp_dynamics_words = {dynamics_words, sizeof(char *), KMP_DYNAMICS_COUNT};
const kmp_name_list kmp_change_points_words = {change_points_words, sizeof(char *), KMP_CHANGE_POINTS_COUNT};
const kmp_name_list kmp_reaction_peaks_words = {reaction_peaks_words, sizeof(char *), KMP_REACTION_PEAKS_COUNT};

const char *kmp_dynamics_word(kmp_dynamics dynamics)
{
    return dynamics_words[dynamics];
}

const char *kmp_change_points_word(kmp_change_points what)
{
    return change_points_words[what];
}

const char *kmp_reaction_peaks_word(kmp_reaction_peaks where)
{
    return reaction_peaks_words[where];
}

kmp_dynamics kmp_dynamics_find(const char *word, kmp_text *complaint)
{
    return (kmp_dynamics)kmp_word_find(word, kmp_dynamics_words, "algorithm", complaint);
}

kmp_change_points kmp_change_points_find(const char *word, kmp_text *complaint)
{
    return (kmp_change_points)kmp_word_find(word, kmp_change_points_words, "value of change_points", complaint);
}

kmp_reaction_peaks kmp_reaction_peaks_find(const char *word, kmp_text *complaint)
{
    return (kmp_reaction_peaks)kmp_word_find(word, kmp_reaction_peaks_words, "value of reaction_peaks", complaint);
}

bool kmp_rows_fit(double every, double t_end, kmp_text *complaint)
{
    double rows = t_end / every;
    if (rows <= KMP_MOST_ROWS)
        return true;
    kmp_text_printf(
        complaint,
        "output_step = %g s gives %.3g rows up to t_end = %g s, but at most %d are stored; use a larger step", every,
        rows, t_end, KMP_MOST_ROWS);
    return false;
}

const kmp_run_settings *kmp_model_run(const kempe_model *model)
{
    return &model->run;
}
