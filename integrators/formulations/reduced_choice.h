/* SPDX-License-Identifier: BSD-3-Clause */
/* The choice of u on the reduced formulation. It ends at a dead centre: |Bvu| grows without bound and det Jv changes
 * sign. */
#pragma once

#include "integrators/formulations/reduced.h"

/** Computes |Bvu| of the present tangent, and decides if an exchange is due. */
void kmp_reduced_judge(kmp_reduced *d);

/** Judges |Bvu| at the step's end, with the signs of Jv's blocks there: KMP_GO, KMP_RETRY, KMP_HALT. */
int kmp_reduced_watch(kmp_reduced *d, double t, const int *signs);

/** Reports why steps have shrunk to nothing: at a dead centre that evaluations cannot pass, or where det Jv repeatedly
 * changes its sign. */
void kmp_reduced_explain(kmp_formulation *formulation);

/** Makes a due exchange at d->q and d->qd, the evaluator's place; y becomes the state in the new unknowns. */
int kmp_reduced_exchange(kmp_reduced *d, double t, double *y);

/** Makes the saddle system of the partition's rows, if it is used. false: no memory. */
bool kmp_reduced_renew_saddle(kmp_reduced *d);
bool kmp_reduced_try_saddle(kmp_reduced *d);
