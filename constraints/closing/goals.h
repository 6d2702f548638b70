/* SPDX-License-Identifier: BSD-3-Clause */
/* Goals of an assembly: minimises the sum of weight ((x - goal) / scale)^2 along the closed positions, starting from
 * the position assembled from the guess. */
#ifndef KMP_CONSTRAINTS_CLOSING_GOALS_H
#define KMP_CONSTRAINTS_CLOSING_GOALS_H

#include "base/arena.h"
#include "dynamics/system.h"

typedef enum kmp_goals_end {
    KMP_GOALS_NONE,    /* no goals, or open loops */
    KMP_GOALS_MINIMUM, /* a local minimum along the closed positions */
    KMP_GOALS_SINGULAR /* ended before a minimum: at a position where the closures lose rank, or after too many steps */
} kmp_goals_end;

typedef struct kmp_goals_verdict {
    kmp_goals_end end;
    int count;       /* number of values with a goal: one per coordinate, three per point, in the order of the model */
    double *value;   /* count: the value reached, rad or m */
    double distance; /* root of the weighted sum of squares */
    double slope;    /* gradient of half the squared distance along the closed positions, over that of all directions */
    int steps;
} kmp_goals_verdict;

/** Allocates the model's goals in the arena. */
void kmp_goals_init(kmp_goals_verdict *verdict, const kempe_model *model, kmp_arena *arena);

/** Measures value and distance of the position q. false: no memory. */
bool kmp_goals_measure(const kempe_system *system, const double *q, kmp_goals_verdict *verdict);

/** Moves q (n), closed at t = 0, with the coordinates in `hold` fixed: sets end, slope and steps. false: no memory. */
bool kmp_goals_seek(const kempe_system *system, const bool *hold, double *q, kmp_goals_verdict *verdict);

#endif
