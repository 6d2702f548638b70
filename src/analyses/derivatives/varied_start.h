/* SPDX-License-Identifier: BSD-3-Clause */
/* The derivative of assembly (constraints/closing/assemble.c) at its solution. */
#pragma once

#include "analyses/derivatives/varied.h"

/** The start of kempe_assembly_new and its derivative for each parameter: q, qd (n), dq, dqd (n x count).
 * KEMPE_E_FAILED: it cannot be assembled, or its derivative depends on choices that the model leaves open; the message
 * lists coordinates to hold. */
kempe_status kmp_sensitivity_equations_start(kmp_sensitivity_equations *varied, double *q, double *qd, double *dq,
                                             double *dqd);
