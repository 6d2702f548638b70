/* SPDX-License-Identifier: BSD-3-Clause */
/* Forces that depend on multipliers, by name. */
#pragma once

#include "dynamics/system.h"

/** The name of a force that depends on multipliers of a row's closure. */
const char *kmp_load_dependent_force(const kempe_system *system, int row);

/** KEMPE_E_ARGUMENT, with the force's name, where some force depends on multipliers and `what` does not support that.
 */
kempe_status kmp_refuse_load_dependent(const kempe_system *system, const char *what);

/** Checks a model without a system; errors as kmp_refuse_load_dependent. */
kempe_status kmp_refuse_load_dependent_model(const kempe_model *model, const char *what);
