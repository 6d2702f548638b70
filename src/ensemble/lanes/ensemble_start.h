/* SPDX-License-Identifier: BSD-3-Clause */
/* Operations on one instance at a time: its start, an exchange of u, its end. The evaluator and the scales of
 * the system belong to the current instance. */
#pragma once

#include "ensemble/lanes/ensemble_inside.h"

/** Reason why lanes can run no instance; NULL: they can. */
const char *kmp_engine_no_lanes(const kmp_engine *e);

/** Assembles an instance and puts it into a pool, or leaves it to a separate run, or writes its failure. */
kempe_status kmp_instance_start(kmp_engine *e, int i);
/** Makes the next choice of u of an instance, from t and y. */
kempe_status kmp_instance_exchange(kmp_engine *e, kmp_lane_group *from, int i);
/** The same for one degree of freedom, only from y and dy: u becomes dependent, and v[k] independent. */
kempe_status kmp_instance_swap(kmp_engine *e, kmp_lane_group *from, int i, int k);
/** Goes on with the choice of u of an instance from e->state at its time. */
kempe_status kmp_instance_resume(kmp_engine *e, kmp_lane_group *from, int i);
/** Makes the next choice of independent rows of an instance, from t and y. */
kempe_status kmp_instance_change_rows(kmp_engine *e, kmp_lane_group *from, int i);
/** Keeps the choice of u of an instance with another order of elimination that is good at t and y. */
kempe_status kmp_instance_reorder(kmp_engine *e, kmp_lane_group *from, int i);
/** Writes the result of an instance, from t and y. */
kempe_status kmp_instance_finish(kmp_engine *e, kmp_lane_group *pool, int i);
/** Takes an instance out of the lanes for a separate run. */
void kmp_instance_leave(kmp_engine *e, int i, const char *why);

/** Puts the values of an instance into the model. KEMPE_E_INPUT: they are impossible, and its result says why. */
kempe_status kmp_instance_take_values(kmp_engine *e, int i);
/** Puts q and qd of an instance in the unknowns of a pool into e->state, with factors and tangent, closed on request.
 * false: Jv is singular, and the instance is left to a separate run. */
bool kmp_instance_unpack(kmp_engine *e, kmp_lane_group *pool, int i, bool closed);

/** True if no joint's angles are nearer to their singular position than this, or the user keeps them. */
bool kmp_instance_has_angles(const kmp_engine *e, const double *q, double least);

/** Goes on from (q, qd) at x->t with another partition, which it frees; `status`: of its choice. */
kempe_status kmp_instance_go_on(kmp_engine *e, int i, kempe_status status, kmp_partition *part, const double *q,
                                const double *qd);
/** Makes an instance that was current before current again. */
void kmp_instance_current(kmp_engine *e, const kmp_instance *x);

/** Computes q and qd at a time from unknowns y of a pool for the present constants, with factors and tangent, on closed
 * loops if `closed`. false: Jv is singular. */
bool kmp_instance_state(kmp_engine *e, kmp_lane_group *pool, double t, const double *y, double *q, double *qd,
                        bool closed);

/* Separate runs of an instance: from its start to its end if lanes cannot run it; or from where a lane left it to
 * where lanes can take it back. Only the instance determines where a part begins and ends. */

/** Repeats an instance in a separate run from its start. */
kempe_status kmp_instance_alone(kmp_engine *e, int i);
/** Continues an instance from t and y in a separate run, until lanes can take it back or to its end. `margin`: the
 * margin of the closures over its usual size; 0: the run finds it. If such a run fails, the instance is left to one
 * from its start. The second begins such a run at a state with closures of this rank. */
kempe_status kmp_instance_apart(kmp_engine *e, kmp_lane_group *from, int i, double margin, const char *why);
kempe_status kmp_instance_start_apart(kmp_engine *e, int i, int rank, double margin, const double *q, const double *qd,
                                      double work, const char *why);

/** Puts an instance into a pool at the present state of its run, with closures of this rank, if lanes can continue it.
 * `margin`: of the last look at it, and of this one; -1: none yet. Only the second look or a later one takes it. */
kempe_status kmp_instance_take_back(kmp_engine *e, int i, kmp_runner *run, int rank, double *margin, bool *taken);
