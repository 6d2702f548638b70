/* SPDX-License-Identifier: BSD-3-Clause */
/* Times of events and their derivatives dt_e/dp (forward.h): of the event that is looked at, and of each condition
 * where it changed last. Several changes at one time have a derivative only if their times depend on the parameters in
 * the same way. */
#pragma once

#include "base/arena.h"
#include "dynamics/system.h"

struct kmp_forward_formulation;

typedef struct kmp_event_times {
    double *swing;                      /* columns: dt_e/dp of the event that is looked at */
    double distance;                    /* the time by which the condition found last is beyond zero */
    int conditions, columns;            /* with room */
    double *swings, *t;                 /* conditions x columns, conditions: where each changed last; NAN: it has not */
    int *cause;                         /* conditions: the one whose change took it along; -1: an input's jump */
    double *along, *jerk, *lambda_rate; /* conditions, n, m: room */
} kmp_event_times;

/** Makes room, once or again for other columns, which forgets all changes. False: no memory. */
bool kmp_event_times_make(kmp_event_times *times, kmp_arena *arena, const kempe_system *system, int columns);

/** True if derivatives of two times are equal up to rounding; if they differ, NULL being zero. */
bool kmp_same_swing(int count, const double *a, const double *b);
bool kmp_swings_differ(int count, const double *a, const double *b);

/** The conditions that differ between two modes change at t, with condition `cause`, at times with the derivatives of
 * `swing`. */
void kmp_event_times_note(kmp_event_times *times, const double *from, const double *to, double t, int cause);

/** Changes no longer count. True if one was at t. */
bool kmp_event_times_forget(kmp_event_times *times, double t);

/** True if condition k changed at t. */
bool kmp_event_times_has(const kmp_event_times *times, int k, double t);

/** dt_e/dp of condition k where it changed last; NULL: zero, as of k = -1. */
const double *kmp_event_times_of(const kmp_event_times *times, int k);

/** True if an event of the motion at t has a time that depends on the parameters (`count`) as `swing` does not. */
bool kmp_event_times_any_other(const kmp_event_times *times, int count, const double *swing, double t);

/** `swing` and `distance` of condition k at the place, which is the last state, with unknowns y. False: the condition
 * is touched, not passed. */
bool kmp_forward_find_swing(struct kmp_forward_formulation *f, int k, const double *y);

/** True if the value of an input jumps at t, where its present piece begins. */
bool kmp_forward_input_jumps(const struct kmp_forward_formulation *f, double t);

/** True if the motion itself crosses condition k where an input jumps, at a time that depends on parameters. */
bool kmp_forward_coincides(struct kmp_forward_formulation *f, int k, double t, const double *y);
