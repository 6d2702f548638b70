/* SPDX-License-Identifier: BSD-3-Clause */
/* Reading of driven and fixed coordinates. */
#ifndef KMP_STUDIES_KINEMATICS_SWEEP_OPTIONS_H
#define KMP_STUDIES_KINEMATICS_SWEEP_OPTIONS_H

#include "studies/kinematics/position_sweep.h"
#include <kempe/kinematics.h>

/** Fills driven values, released closures, rows and speed; fixed coordinates are still 0. KEMPE_E_ARGUMENT,
 * KEMPE_E_MEMORY.
 */
kempe_status kmp_kinematics_ask(kempe_kinematics *k, const kempe_kinematics_options *ask);

/** Reports driven coordinates that do not determine the rest: too few, too many, or in conflict. */
kempe_status kmp_kinematics_check_leads(kempe_kinematics *k, kmp_sweep *sweep);

#endif
