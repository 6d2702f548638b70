/* SPDX-License-Identifier: BSD-3-Clause */
/* Rounded drawings: closures that are redundant but for rounding of the model's numbers. J of such a mechanism has a
 * higher rank than the intended mechanism, with pivots of the size of the rounding, and its loops close nowhere or at a
 * few places. The intended rank is found once, when the loops are assembled, and kept in the system: every choice of
 * rows uses it. Rows beyond it are dropped; they stay open by their misfit, which is monitored. */
#pragma once

#include "constraints/evaluation/evaluator.h"

struct kmp_walk;

/** NULL: closures hold as written. */
const kmp_rounding *kmp_rounding_of(const kempe_system *system);

/** True if the assembly at the start has looked for redundant closures with the present numbers; it has found none
 * after kmp_rounding_keep_none. */
bool kmp_rounding_is_known(const kempe_system *system);
void kmp_rounding_keep_none(const kempe_system *system);

/** Zero tolerance for pivots of J, and for directions of its rows: `strict`, or more if numbers are rounded. */
double kmp_rounding_zero(const kempe_system *system, double strict);

/** True if every row, dropped ones included, is closed at the evaluator's last closure up to rounding of the model's
 * numbers. With the kept rows alone a long step may reach another branch. */
bool kmp_rounding_closed(const kmp_evaluator *eval);

/** A configuration reached by finite motions. */
typedef struct kmp_waypoint {
    double open;     /* the widest row, scaled */
    double distance; /* from the first */
    double weak;     /* the largest pivot beyond walk->rank, over the first */
    double strong;   /* the last before it */
} kmp_waypoint;

/** Configurations closed on walk->rank rows, none near a change point, reached on several random paths from the first,
 * given in q. Returns their number, at most `wanted`; writes q (n x (wanted + 1), the last for scratch) and `place`.
 * part: relative tolerances of rows (m), NULL: 1. Ends early where a trial with this tolerance cannot hold any more
 * (INFINITY: never). */
int kmp_rounding_waypoints(struct kmp_walk *walk, const double *part, int wanted, double tolerance, double *q,
                           kmp_waypoint *place);

/** The widest row at the walk's last state. */
double kmp_rounding_opening(const struct kmp_walk *walk, const double *part);

/** Test of a rank at a state that is closed but for the rows that it drops. */
typedef struct kmp_rounding_trial {
    int rank;
    const bool *dropped; /* m: rows beyond it */
    double tolerance;    /* scaled */
    bool holds;          /* the rows beyond the rank stay open by less than the tolerance in all configurations */
    bool refuted;        /* they are open in every distant configuration, so many that the others do not count */
    double here;         /* scaled: the widest of these rows at the state */
    double most;         /* the widest of these rows on the path */
    double zero;         /* zero tolerance for pivots of rounding */
} kmp_rounding_trial;

/** Tests a rank by random motions from q (n). chart: of the spherical joints, NULL: their own. false: no memory. */
bool kmp_rounding_try(kmp_rounding_trial *trial, const kempe_system *system, const double *q, const double *chart);

/** Marks the rows of moving closures and drives in `driven` (m), and returns how many of them are not in `dropped`.
 * Without these rows a mechanism moves as its loops allow. */
int kmp_rounding_drives(const kempe_system *system, const bool *dropped, bool *driven);

/** Writes a trial that holds into the system, unless another assembly has. */
void kmp_rounding_keep(const kempe_system *system, const kmp_rounding_trial *trial);
