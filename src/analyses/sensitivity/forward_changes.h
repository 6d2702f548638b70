/* SPDX-License-Identifier: BSD-3-Clause */
/* Changes within a formulation of a motion with sensitivities, and what events of the run share with them. */
#pragma once

#include "analyses/sensitivity/forward_inside.h"

/** Makes room. False: no memory. */
bool kmp_forward_changes_make(kmp_forward_formulation *f);

/** Ends the motion, with the reason. */
int kmp_forward_halt(kmp_forward_formulation *f, const char *format, ...) __attribute__((format(printf, 2, 3)));

/** Ends the motion where an input jumps as the motion crosses condition k. */
int kmp_forward_halt_at_input(kmp_forward_formulation *f, int k, double t);

/** Gives the evaluator the conditions and charts of the last step; then again its present ones. */
void kmp_forward_step_back(kmp_forward_formulation *f);
void kmp_forward_step_forth(kmp_forward_formulation *f);

double kmp_forward_integrand_here(kmp_forward_formulation *f);

/** Passes what has changed: next values of states, delayed signals (`jump`), conditions, charts. */
int kmp_forward_pass_changes(kmp_forward_formulation *f, double t, const double *q, const double *qd,
                             const double *jump, double *y);
