/* SPDX-License-Identifier: BSD-3-Clause */
/* What is to be driven and held, read. */
#ifndef KMP_STUDIES_KINEMATICS_SWEEP_OPTIONS_H
#define KMP_STUDIES_KINEMATICS_SWEEP_OPTIONS_H

#include "studies/kinematics/position_sweep.h"
#include <kempe/kinematics.h>

/** Fills leads, released closures, rows and speed; held coordinates are at 0 still. KEMPE_E_ARGUMENT, KEMPE_E_MEMORY.
 */
kempe_status kmp_kinematics_ask(kempe_kinematics *k, const kempe_kinematics_options *ask);

/** Complains of what is driven where it does not determine the rest: too little, too much, or against each other. */
kempe_status kmp_kinematics_check_leads(const kempe_kinematics *k, kmp_sweep *sweep);

#endif
