/* SPDX-License-Identifier: BSD-3-Clause */
/* Events: where a condition of the model changes within a step. The step was made with all conditions held, so the
 * solution is smooth beyond the event; it is cut there, the conditions change, and the integrator starts anew. */
#ifndef KMP_INTEGRATORS_EVENTS_H
#define KMP_INTEGRATORS_EVENTS_H

#include "integrators/road.h"
#include "integrators/solver.h"

typedef struct kmp_crossing kmp_crossing;

/** NULL: no memory. All are used as they are at the time of a call. span: length of the run. */
kmp_crossing *kmp_crossing_new(const kempe_system *system, kmp_plant *plant, kmp_road *road,
                               const kmp_solver_kind *kind, kmp_solver *solver, double span, kmp_journal *journal);
void kmp_crossing_free(kmp_crossing *crossing);

/** Goes on with another road and integrator. false: no memory. */
bool kmp_crossing_move(kmp_crossing *crossing, kmp_road *road, const kmp_solver_kind *kind, kmp_solver *solver);

/** Looks for the earliest event of the last step. *t is where, just beyond the change; left alone when there is none.
 */
kempe_status kmp_crossing_find(kmp_crossing *crossing, double *t, bool *found);

/** For a run that checks another one: each step is looked at in more places. */
void kmp_crossing_look_closely(kmp_crossing *crossing);

/** Kinks of abs, min and max are passed like events, for one-step methods: between them the equations are smooth, which
 * is what high orders live on. They are neither counted nor noted. Multistep methods, which begin at order one behind
 * each, gain nothing. Where one is passed within what steps err by, it is run over. */
void kmp_crossing_hold_kinks(kmp_crossing *crossing, double rtol);

/** What was seen at the end of the last step no longer holds: accelerations are others. */
void kmp_crossing_forget(kmp_crossing *crossing);

/** The condition that ends the run at what was found last, -1: none does. */
int kmp_crossing_end(const kmp_crossing *crossing);

/** The same at a start, where the integrator is. */
kempe_status kmp_crossing_begin(kmp_crossing *crossing, double t, bool *ends);

/** Changes the conditions at such a t, closes the state and puts it into y (and yp): the new start. KEMPE_E_FAILED with
 * a message when conditions change back and forth without end. */
kempe_status kmp_crossing_pass(kmp_crossing *crossing, double t, double *y, double *yp);

/** Changes the conditions where the closed state at such a t is (q, qd). `again`: the same with other rates; what has
 * changed before stays so, for positions that are closed anew differ by rounding. *changed: one did. */
kempe_status kmp_crossing_change(kmp_crossing *crossing, double t, const double *q, const double *qd, bool again,
                                 bool *changed);

/** Whether conditions have changed back and forth without end. */
bool kmp_crossing_is_stuck(const kmp_crossing *crossing);

/** Events so far. */
long kmp_crossing_count(const kmp_crossing *crossing);

#endif
