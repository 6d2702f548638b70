/* SPDX-License-Identifier: BSD-3-Clause */
/* Quantities of instances, in lanes and in separate runs: the account of each instance gets the states of its steps,
 * so that it does not depend on other instances. A lane's states follow from its interpolant on closed loops. */
#pragma once

#include "ensemble/lanes/ensemble_inside.h"

/** Makes what an engine needs for the quantities of its run, and the accounts of a chunk. false: no memory. */
bool kmp_measuring_init(kmp_engine *e);
bool kmp_measuring_chunk(kmp_engine *e);

/** Begins the account of an instance at its start. */
void kmp_instance_begin_account(kmp_engine *e, int i);

/** True if the dense output of steps is needed. */
bool kmp_measures_steps(const kmp_engine *e);

/** Makes the program of a pool that quantities of accelerations and multipliers need. false: no memory. */
bool kmp_lane_group_complete(kmp_engine *e, kmp_lane_group *pool);

/** Rows of all lanes, q then qd, from the unknowns and their slopes. */
void kmp_lanes_spread(const kmp_engine *e, const kmp_lane_group *pool, const double *y, const double *slope,
                      double *rows);

/** Takes the last step of a separate run into account. false: some state within it is not
 * available. */
bool kmp_run_measure(kmp_engine *e, int i, kmp_runner *run);

/** Writes the quantities at the end of an instance, at q and qd on closed loops; `row`: q, qd, qdd, lambda there, NULL:
 * not known. `pool`: of its lane. */
void kmp_instance_measured(kmp_engine *e, kmp_lane_group *pool, int i, double t, const double *row);

/** Takes the accepted steps into the accounts of their instances; `searched`: lanes whose stages of the dense output
 * are counted, NULL: these are not known. */
void kmp_taken_measure(kmp_engine *e, kmp_lane_group *pool, const bool *searched, kmp_attempt *what);
