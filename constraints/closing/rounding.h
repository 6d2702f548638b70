/* SPDX-License-Identifier: BSD-3-Clause */
/* A trial of a rank by finite motions: it shows whether closures are redundant but for rounding of the model's numbers.
 * Its result is kept in the system (constraints/evaluation/evaluator.h). */
#pragma once

#include "constraints/evaluation/evaluator.h"
#include "model/data/closure.h"
#include <kempe/kempe.h>
#include <stdbool.h>

struct kmp_walk;

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
    bool refuted;        /* they are open in every distant configuration, and the others do not count */
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

/* The links of a loop as a polygon, which closes only if no side is longer than all others together. */

/** The polygon of one loop: its longest side and the sum of all sides, m. */
typedef struct kmp_loop_polygon {
    const kempe_model *model;
    double longest, sum;
    bool slides;        /* a joint of the loop slides */
    int body, from, to; /* of the longest side: points, -1 the origin */
} kmp_loop_polygon;

/** The polygon of a closure between two points. */
kmp_loop_polygon kmp_loop_polygon_of(const kempe_model *model, const kmp_closure *closure);
