/* SPDX-License-Identifier: BSD-3-Clause */
#pragma once

#include "model/data/wheels.h"
#include "rail/contact/half_space.h"
#include "rail/wheel_contact/contact_sweep.h"
#include <stdbool.h>

/** Reads the method, and the division of a grid; kmp_pressure_word is the word of a method, NULL for none. */
kempe_status kmp_contact_pressure_request(kempe_contacts *table, const char *word);
const char *kmp_pressure_word(kmp_pressure_method method);

/** Evaluates the pressures of a patch, from the pose of its wheel; the outline is allocated in the arena of the table.
 */
kempe_status kmp_contact_pressure(kempe_contacts *table, int wheel, int zone, const double *pose,
                                  kempe_contact_patch *patch, kmp_patch_outline *outline);
