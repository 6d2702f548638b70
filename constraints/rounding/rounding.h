/* SPDX-License-Identifier: BSD-3-Clause */
/* Rounded drawings: closures that are redundant but for rounding of the model's numbers. J of such a mechanism has more
 * rank than the mechanism that is meant, by pivots of the size of the rounding, and its loops close nowhere or at a few
 * places. The rank that is meant is found once, when the loops are assembled, and kept in the system: every choice of
 * rows takes it from there. Rows beyond it are dropped; they stay open by their misfit, which is watched. */
#ifndef KMP_CONSTRAINTS_ROUNDING_ROUNDING_H
#define KMP_CONSTRAINTS_ROUNDING_ROUNDING_H

#include "constraints/evaluation/plant.h"

struct kmp_walk;

/** NULL: closures are what they say. */
const kmp_rounding *kmp_rounding_of(const kempe_system *system);

/** What tells pivots of J, and directions of its rows, from zero there: `strict`, or more where numbers are rounded. */
double kmp_rounding_zero(const kempe_system *system, double strict);

/** True if every row, dropped ones included, is closed at the plant's last closure up to rounding of the model's
 * numbers. With the kept rows alone a long step may reach another branch. */
bool kmp_rounding_closed(const kmp_plant *plant);

/** A configuration that finite motions lead to. */
typedef struct kmp_waypoint {
    double open;     /* the widest row, scaled */
    double distance; /* from the first */
    double weak;     /* the largest pivot beyond walk->rank, over the first */
    double strong;   /* the last before it */
} kmp_waypoint;

/** Closed on walk->rank rows, none beside a change point: by several random ways from the first, which stands in q; how
 * many there are, at most `wanted`, into q (n x (wanted + 1), the last for scratch) and `place`. part: of row openings
 * (m), NULL: 1. */
int kmp_rounding_waypoints(struct kmp_walk *walk, const double *part, int wanted, double *q, kmp_waypoint *place);

/** The widest row at the walk's last state. */
double kmp_rounding_opening(const struct kmp_walk *walk, const double *part);

/** What a rank means at a state that is closed but for the rows that it drops. */
typedef struct kmp_rounding_trial {
    int rank;
    const bool *dropped; /* m: rows beyond it */
    double tolerance;    /* scaled */
    bool holds;          /* the rows beyond the rank stay open by less than the tolerance wherever the mechanism goes */
    double here;         /* scaled: the widest of them at the state */
    double most;         /* and on the way */
    double zero;         /* what tells pivots of rounding from others */
} kmp_rounding_trial;

/** Moves from q (n) at random. chart: of the spherical joints, NULL: their own. false: no memory. */
bool kmp_rounding_try(kmp_rounding_trial *trial, const kempe_system *system, const double *q, const double *chart);

/** The rows of what moves in time or is driven, to `driven` (m), and how many of them are not in `dropped`. Without
 * them a mechanism moves as its loops let it. */
int kmp_rounding_drives(const kempe_system *system, const bool *dropped, bool *driven);

/** Writes a trial that holds into the system, unless another assembly has. */
void kmp_rounding_keep(const kempe_system *system, const kmp_rounding_trial *trial);

#endif
