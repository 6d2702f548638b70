/* SPDX-License-Identifier: BSD-3-Clause */
/* Instances that stay in lanes from one step of the caller to the next. Between two steps an instance rests in a pool:
 * with its unknowns, conditions and step size. In each step it has inputs of the caller and a separate end. An
 * instance that lanes cannot take to that end returns to where its step began, and the caller takes it from there. */
#pragma once

#include "ensemble/lanes/ensemble_inside.h"

typedef struct kmp_lane_steps kmp_lane_steps;

/** Makes room for `count` instances of a run that has begun, which have not begun. Their q and qd after each step are
 * rows of the caller (count x n). The engine has no chunk meanwhile. kmp_lane_steps_end: before kmp_engine_end. */
kempe_status kmp_lane_steps_new(kmp_engine *e, int count, double *q, double *qd);
void kmp_lane_steps_end(kmp_engine *e);

/** Begins an instance at t = 0, at a start with closed loops (q and qd, 2 n numbers), or at the start of the model
 * (NULL). */
kempe_status kmp_lane_steps_begin(kmp_engine *e, int i, const double *start);

/** The reason why an instance is not in lanes, where it has begun; NULL: it is. */
const char *kmp_lane_steps_absence(const kmp_engine *e, int i);

/** Lets an instance in lanes take a step to `end`, with inputs that are constant from now on. */
kempe_status kmp_lane_steps_prepare(kmp_engine *e, int i, double end, int count, const int *inputs,
                                    const double *values);

/** After kmp_engine_run_pools, for each instance that was prepared. True: it is at its end, and its row is there.
 * False: it is where its step began, because an interrupt ended the call or lanes cannot take it further
 * (kmp_lane_steps_absence). */
bool kmp_lane_steps_settle(kmp_engine *e, int i);

/** Takes an instance out of the lanes, at the end of a step that took far more steps of the integrator than a smooth
 * motion needs: stability limits them, or a fast motion. true: it did. */
bool kmp_lane_steps_dismiss(kmp_engine *e, int i);

/** The time of an instance, and the inputs there. Its row (q, qd, qdd, lambda), where `late` asks for accelerations and
 * multipliers; NaN: these are not available. */
double kmp_lane_steps_time(const kmp_engine *e, int i);
const kmp_present_inputs *kmp_lane_steps_inputs(const kmp_engine *e, int i);
void kmp_lane_steps_row(kmp_engine *e, int i, bool late, double *row);

/** An instance as a run may continue it: closed q and qd in `row`, the rest by pointers into the instance. */
typedef struct kmp_lane_handed {
    double t, work, h, rate_scale;
    const double *modes;              /* NULL: there are no conditions */
    const void *memory;               /* NULL: nothing happens between its steps */
    const kmp_present_inputs *inputs; /* before the inputs of the step */
    double *row;                      /* 2 n */
} kmp_lane_handed;

/** Hands an instance over that has left the lanes. false: its loops do not close. */
bool kmp_lane_steps_hand_over(kmp_engine *e, int i, kmp_lane_handed *handed);

/** Takes an instance back from a run that has made its step to `t`, if lanes can continue it. */
kempe_status kmp_lane_steps_take_back(kmp_engine *e, int i, kmp_runner *run, double t, bool *taken);

/** Lets an instance that has begun in lanes continue as a run that has begun at the same state, with the samples and
 * modes of its past. Otherwise it leaves the lanes. */
kempe_status kmp_lane_steps_begin_as(kmp_engine *e, int i, kmp_runner *run);

/* Called in lanes. */

/** Lets an instance rest that has come to its end; false: it has not, or the engine runs a chunk. */
bool kmp_lane_steps_rest(kmp_engine *e, kmp_lane_group *pool, int i);

/** Writes the row of an instance at its end: from its unknowns and slopes; from e->state, if it is there. */
void kmp_lane_steps_show(kmp_engine *e, const kmp_lane_group *pool, int i);
void kmp_lane_steps_show_state(kmp_engine *e, int i);

/** Takes an instance with closures of this rank out of the lanes for a run of the caller, which may give it back;
 * false: the engine runs a chunk. */
bool kmp_lane_steps_leave(kmp_engine *e, int i, int rank, const char *why);
