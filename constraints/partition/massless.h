/* SPDX-License-Identifier: BSD-3-Clause */
/* Which motion carries no mass, when accelerations are not determined. */
#ifndef KMP_CONSTRAINTS_PARTITION_MASSLESS_H
#define KMP_CONSTRAINTS_PARTITION_MASSLESS_H

#include "constraints/evaluation/plant.h"
#include "constraints/partition/partition.h"

/** KEMPE_E_FAILED with a sentence that names the coordinate that moves most in the motion of least reduced mass at
 * (t, q), a closed configuration; KEMPE_E_MEMORY. */
kempe_status kmp_explain_massless(kmp_plant *plant, const kmp_partition *part, double t, const double *q);

/** The same sentence in `why` where the reduced mass is singular to rounding; nothing where it is regular. KEMPE_OK,
 * KEMPE_E_MEMORY. */
kempe_status kmp_foresee_massless(kmp_plant *plant, const kmp_partition *part, double t, const double *q,
                                  kmp_text *why);

#endif
