/* SPDX-License-Identifier: BSD-3-Clause */
/* Multipliers in equations that are written: which are needed, and which are not supported. */
#pragma once

#include <kempe/kempe.h>
#include <stdbool.h>

/** True if a force, a sensor or a requested output has a multiplier of a drive or a lock. */
bool kmp_uses_drives(const kempe_model *model);

/** KEMPE_E_ARGUMENT, with the force's name, where some force depends on multipliers and `what` does not support that.
 */
kempe_status kmp_refuse_load_dependent_model(const kempe_model *model, const char *what);
