/* SPDX-License-Identifier: BSD-3-Clause */
/* Programs of the reduced formulation for the present choice of u: the program by the reduced mass, or the one by the
 * saddle system where that pays. Programs of earlier choices are kept, because a motion returns to them: a rocker that
 * swings exchanges u at each end. */
#pragma once

#include "integrators/formulations/reduced.h"

/** Keeps the programs of the present choice of u, which is about to change, for its return. false: no memory. */
bool kmp_reduced_keep(kmp_reduced *d);

/** Makes the reduced program for the present choice of u with its factors, if it is `worth` while or the choice
 * returns; or takes the one that was kept. The program by the saddle system,
 * where there is none, is made when it pays. */
int kmp_reduced_make_program(kmp_reduced *d, bool worth);

/** Makes the program by the saddle system at d->q, the end of the last step, if that pays by now. */
int kmp_reduced_solve(kmp_reduced *d, double t);

/** Makes the program that is used, or will be, ready for several stages at once. */
int kmp_reduced_make_lanes(kmp_reduced *d, double t);

/** Counts the cycles of evaluations by the present programs, or by the program by the saddle system that may be made.
 */
int kmp_reduced_count(kmp_reduced *d);

void kmp_reduced_free_programs(kmp_reduced *d);
