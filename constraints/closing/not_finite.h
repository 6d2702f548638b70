/* SPDX-License-Identifier: BSD-3-Clause */
/* Names the values in the equations at a state that are not finite. */
#ifndef KMP_CONSTRAINTS_CLOSING_NOT_FINITE_H
#define KMP_CONSTRAINTS_CLOSING_NOT_FINITE_H

#include "constraints/evaluation/evaluator.h"

/** Appends a sentence about the first entry of h, J, M or C at (t, q, qd) that is not finite, with the forces that may
 * be the cause. false: all are finite, and nothing is appended. */
bool kmp_put_not_finite(kmp_evaluator *eval, double t, const double *q, const double *qd, kmp_text *text);

#endif
