/* SPDX-License-Identifier: BSD-3-Clause */
/* Derivatives of delayed signals y(t) = u(t - T). */
#pragma once

#include "analyses/sensitivity/forward_inside.h"

/** Makes room, where there are any. False: no memory. */
bool kmp_forward_delays_make(kmp_forward_formulation *f);
void kmp_forward_delays_free(kmp_forward_formulation *f);

/** Begins their past at the place, which has the values of the start at t; sets the derivatives of their states there.
 */
kempe_status kmp_forward_delays_begin(kmp_forward_formulation *f, double t);

/** Records the last step up to `to`. False: it cannot be evaluated. */
bool kmp_forward_delays_record(kmp_forward_formulation *f, kmp_runner *runner, double to);

/** The rates of their states' derivatives by parameter p at the last state, which is the state of y, among sudd. */
void kmp_forward_delays_rates(const kmp_forward_formulation *f, const double *y, int p, double *sudd);

/** Sets the derivatives of their states in y at t. */
void kmp_forward_delays_set(kmp_forward_formulation *f, double t, double *y);

/** Notes dt/dp of a restart at t. */
void kmp_forward_delays_note(kmp_forward_formulation *f, double t, const double *swing);

/** dt/dp where delayed signals jump at t; NULL: none does. KMP_HALT: several do, at different times. */
int kmp_forward_delays_jump(kmp_forward_formulation *f, double t, const double **swing);

/** Puts their states (of qd) and derivatives along a time with f->times.swing into the place. */
void kmp_forward_delays_pass(kmp_forward_formulation *f, double t, const double *qd);
