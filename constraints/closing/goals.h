/* SPDX-License-Identifier: BSD-3-Clause */
/* Goals of an assembly: along the closed positions from the one that the guess led to, the sum of
 * weight ((x - goal) / scale)^2 is brought to a minimum. */
#ifndef KMP_CONSTRAINTS_CLOSING_GOALS_H
#define KMP_CONSTRAINTS_CLOSING_GOALS_H

#include "base/arena.h"
#include "dynamics/system.h"

typedef enum kmp_goals_end {
    KMP_GOALS_NONE,    /* there are none, or the loops are open */
    KMP_GOALS_MINIMUM, /* no way along the closed positions leads nearer */
    KMP_GOALS_SINGULAR /* the way down ends before: at a position where the closures lose rank, or after too many steps
                        */
} kmp_goals_end;

typedef struct kmp_goals_verdict {
    kmp_goals_end end;
    int count;       /* values with a goal: one a coordinate, three a point, in the order of the model */
    double *value;   /* count: what is reached, rad or m */
    double distance; /* root of the weighted sum of squares */
    double slope;    /* the gradient of half its square along the closed positions, over that of all directions */
    int steps;
} kmp_goals_verdict;

/** Room for the model's goals in the arena. */
void kmp_goals_init(kmp_goals_verdict *verdict, const kempe_model *model, kmp_arena *arena);

/** What the position q reaches: value and distance. false: no memory. */
bool kmp_goals_measure(const kempe_system *system, const double *q, kmp_goals_verdict *verdict);

/** Moves q (n), closed at t = 0, with the coordinates in `hold` where they are: end, slope and steps. false: no memory.
 */
bool kmp_goals_seek(const kempe_system *system, const bool *hold, double *q, kmp_goals_verdict *verdict);

#endif
