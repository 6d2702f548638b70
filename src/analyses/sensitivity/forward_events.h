/* SPDX-License-Identifier: BSD-3-Clause */
/* Events that end a formulation of a motion with sensitivities. */
#pragma once

#include "analyses/sensitivity/forward_inside.h"

/** Keeps the place before an event of the run that changes rows or rates, with the derivatives of the last state at
 * t_e(p), along the event. */
int kmp_forward_leave_at_event(kmp_forward_formulation *f, double t, const double *y);

/** Takes next values of states and delayed signals, which may jump only at an event of the run. */
int kmp_forward_arrive_with_signals(kmp_forward_formulation *f, const kmp_formulation_start *start, bool first);

/** Derivatives of the rates behind an event of the run, or behind an impact at the start, in the place. */
int kmp_forward_arrive_after_event(kmp_forward_formulation *f, const kmp_formulation_start *start, bool first);

/** Ends an event: the derivatives at constant time, and what rows hold from now on. */
int kmp_forward_go_on_after_event(kmp_forward_formulation *f, const kmp_formulation_start *start, double *y);
