/* SPDX-License-Identifier: BSD-3-Clause */
/* Causes of states without accelerations: angles at their singular position, values that are not finite, motions that
 * carry no mass. */
#pragma once

#include "constraints/evaluation/evaluator.h"
#include "constraints/partition/partition.h"

/** Appends a clause that names a joint with three rotations that are singular at q, or nearly, if there is one. Three
 * rotations of one joint are singular where the second turns the third axis into the plane of the first two: their
 * angles are then no coordinates of the orientation, and M is singular. */
void kmp_angles_explain(const kempe_model *model, const double *q, kmp_text *text);

/** Appends a sentence about the first entry of h, J, M or C at (t, q, qd) that is not finite, with the forces that may
 * be the cause. false: all are finite, and nothing is appended. */
bool kmp_put_not_finite(kmp_evaluator *eval, double t, const double *q, const double *qd, kmp_text *text);

/** KEMPE_E_FAILED with a sentence that names the most displaced coordinate in the motion of least reduced mass at (t,
 * q), a closed configuration; KEMPE_E_MEMORY. */
kempe_status kmp_explain_massless(kmp_evaluator *eval, const kmp_partition *part, double t, const double *q);

/** Writes the sentence of kmp_explain_massless to `why` if the reduced mass is singular to rounding; nothing if it is
 * regular. KEMPE_OK, KEMPE_E_MEMORY. */
kempe_status kmp_foresee_massless(kmp_evaluator *eval, const kmp_partition *part, double t, const double *q,
                                  kmp_text *why);

/** Appends `before` and the motion that moves no mass at (t, q), if the reduced mass is singular to rounding there; the
 * evaluator makes M. KEMPE_OK, KEMPE_E_MEMORY. */
kempe_status kmp_put_massless(kmp_evaluator *eval, const kmp_partition *part, double t, const double *q,
                              const char *before, kmp_text *text);
