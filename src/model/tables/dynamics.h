/* SPDX-License-Identifier: BSD-3-Clause */
/* The words for the algorithm of a run's dynamics. */
#ifndef KMP_MODEL_TABLES_DYNAMICS_H
#define KMP_MODEL_TABLES_DYNAMICS_H

#include "model/tables/nearest.h"

typedef enum kmp_dynamics {
#define KMP_DYNAMICS(id, word) KMP_DYNAMICS_##id,
#include "model/tables/dynamics.def"
#undef KMP_DYNAMICS
    KMP_DYNAMICS_COUNT
} kmp_dynamics;

const char *kmp_dynamics_word(kmp_dynamics dynamics);

/** KMP_DYNAMICS_COUNT when no algorithm has that name. The message is appended to `complaint` then: the word, the valid
 * words and the nearest one. */
kmp_dynamics kmp_dynamics_find(const char *word, kmp_text *complaint);

#endif
