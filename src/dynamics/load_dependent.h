/* SPDX-License-Identifier: BSD-3-Clause */
/* Forces that depend on multipliers, friction that sticks, and states, by name where a study does not support them. */
#pragma once

#include "dynamics/system.h"

/** KEMPE_E_ARGUMENT, with a state's name, where the model has sampled states, or ones that change at events unless
 * `held`, and `what` does not follow them. */
kempe_status kmp_refuse_samples(const kempe_model *model, const char *what, bool held);

/** KEMPE_E_ARGUMENT, with a state's name, where the model has delays of continuous signals, which `what` does not
 * follow; the remedy. */
kempe_status kmp_refuse_delays(const kempe_model *model, const char *what, const char *remedy);
#define KMP_INSTEAD_OF_DELAY "replace the delay by a transfer function (Pade) or by samples"

/** True if a force, a sensor or a requested output has a multiplier of a drive or a lock. */
bool kmp_uses_drives(const kempe_model *model);

/** The name of a force that depends on multipliers of a row's closure. */
const char *kmp_load_dependent_force(const kempe_system *system, int row);

/** KEMPE_E_ARGUMENT, with the force's name, where some force depends on multipliers and `what` does not support that.
 */
kempe_status kmp_refuse_load_dependent(const kempe_system *system, const char *what);

/** Checks a model without a system; errors as kmp_refuse_load_dependent. */
kempe_status kmp_refuse_load_dependent_model(const kempe_model *model, const char *what);

/** KEMPE_E_ARGUMENT, with its name, where the model has friction that sticks and `what` has no modes for it. */
kempe_status kmp_refuse_friction(const kempe_model *model, const char *what);

/** KEMPE_E_ARGUMENT, with its name, where the model has rigid contacts and `what` does not open and close them. */
kempe_status kmp_refuse_contacts(const kempe_model *model, const char *what);
