/* SPDX-License-Identifier: BSD-3-Clause */
/* Changes within a formulation of a motion with sensitivities, and what events of the run share with them. */
#pragma once

#include "analyses/sensitivity/forward_inside.h"

/** Ends the motion, with the reason. */
int kmp_forward_halt(kmp_forward_formulation *f, const char *format, ...) __attribute__((format(printf, 2, 3)));

void kmp_forward_set_modes(const kmp_forward_formulation *f, const double *mode);

/** dt_e/dp of condition k at the place, which is the last state, with unknowns y. False: the condition is touched, not
 * passed. */
bool kmp_forward_find_swing(kmp_forward_formulation *f, int k, const double *y);

/** Ends the motion where a sample and an event have one time, of which only the time of the sample is the same for all
 * parameters; the second function: where an input jumps as the motion crosses condition k. */
int kmp_forward_halt_at_event(kmp_forward_formulation *f, int sample, double t);
int kmp_forward_halt_at_input(kmp_forward_formulation *f, int k, double t);

/** True if derivatives of two times differ; NULL is zero. */
bool kmp_forward_are_different(const kmp_forward_formulation *f, const double *a, const double *b);

double kmp_forward_integrand_here(kmp_forward_formulation *f);

/** The conditions that change at t, to `mode`, do so at times with the derivatives f->swing, by condition k. */
void kmp_forward_note_swings(kmp_forward_formulation *f, const double *mode, double t, int k);

/** True if the value of an input jumps at t, where its present piece begins. */
bool kmp_forward_input_jumps(const kmp_forward_formulation *f, double t);

/** True if the motion itself crosses condition k where an input jumps, at a time that depends on parameters. */
bool kmp_forward_coincides(kmp_forward_formulation *f, int k, double t, const double *y);

/** f->swing for the first time that is noted, which those after it follow from; `jump`: of delayed signals that jump,
 * NULL without any. */
int kmp_forward_find_reset_swing(kmp_forward_formulation *f, const double *jump, double t);

/** Maps the place, whose derivatives are those along the event, by the next values noted at each time. */
void kmp_forward_take_next_values(kmp_forward_formulation *f, double t);

/** Passes what has changed: next values of states, delayed signals (`jump`), conditions, charts. */
int kmp_forward_pass_changes(kmp_forward_formulation *f, double t, const double *q, const double *qd,
                             const double *jump, double *y);
