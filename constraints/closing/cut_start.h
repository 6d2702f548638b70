/* SPDX-License-Identifier: BSD-3-Clause */
/* Start values of coordinates of cut joints (model/data/coordinates.h): they are part of the guess from which the
 * loops are closed, and of the given rates. */
#pragma once

#include "constraints/evaluation/evaluator.h"

/** Moves the coordinates q (n) that are not held from their guess to where the loops and these coordinates together are
 * met best; no change where no such value is given. False: no memory. */
bool kmp_cut_start_guess(const kempe_system *system, const bool *hold, double *q);

/** Changes the rates qd (n) that are not fixed by least changes, so that the closures at the last position of `eval`,
 * which is q, and the given rates of cut joints are met best. False: no memory. */
bool kmp_cut_start_rates(kmp_evaluator *eval, const bool *fixed, const double *q, double *qd);

/** A given value of a cut joint that (q, qd) in the user's own charts misses: a rotation by more than a quarter turn,
 * or a rate beyond rounding. Its number in model->cut_coordinates, with its own value; *rate says which of the two. -1:
 * none; -2: no memory. */
int kmp_cut_start_missed(const kempe_system *system, const double *q, const double *qd, bool *rate, double *value);
