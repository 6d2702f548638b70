/* SPDX-License-Identifier: BSD-3-Clause */
/* The motion that carries no mass, if accelerations are not determined. */
#ifndef KMP_CONSTRAINTS_PARTITION_MASSLESS_H
#define KMP_CONSTRAINTS_PARTITION_MASSLESS_H

#include "constraints/evaluation/evaluator.h"
#include "constraints/partition/partition.h"

/** KEMPE_E_FAILED with a sentence that names the most displaced coordinate in the motion of least reduced mass at (t,
 * q), a closed configuration; KEMPE_E_MEMORY. */
kempe_status kmp_explain_massless(kmp_evaluator *eval, const kmp_partition *part, double t, const double *q);

/** Writes the sentence of kmp_explain_massless to `why` if the reduced mass is singular to rounding; nothing if it is
 * regular. KEMPE_OK, KEMPE_E_MEMORY. */
kempe_status kmp_foresee_massless(kmp_evaluator *eval, const kmp_partition *part, double t, const double *q,
                                  kmp_text *why);

#endif
