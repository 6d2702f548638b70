/* SPDX-License-Identifier: BSD-3-Clause */
/* Modes of all elements at a state: the decision, rows that are held, and what changes. */
#pragma once

#include "integrators/friction/friction_site.h"

/** Decides on modes at t and the state (q, qd); rates are made consistent with the rows that are held, and the site is
 * evaluated there. */
KMP_LOCAL int kmp_friction_settle_modes(kmp_friction_run *x, double t, double *q, double *qd);
