/* SPDX-License-Identifier: BSD-3-Clause */
#pragma once

#include "studies/simulate/trajectory.h"

/** The contacts of one force element. KEMPE_E_MEMORY. */
kempe_status kmp_contact_times_find(const kempe_trajectory *trajectory, int force, kmp_contact_times *times);

/** Of the k-th contact of the log: its largest depth in the unit of the element, NaN: it has not ended. */
double kmp_contact_time_depth(const kempe_trajectory *trajectory, int k);
