/* SPDX-License-Identifier: BSD-3-Clause */
/* Forces and states that some studies do not support, refused by name. */
#pragma once

#include "dynamics/load_dependent.h"

/** KEMPE_E_ARGUMENT, with a state's name, where the model has sampled states, or ones that change at events unless
 * `held`, and `what` does not follow them. */
kempe_status kmp_refuse_samples(const kempe_model *model, const char *what, bool held);

/** KEMPE_E_ARGUMENT, with the force's name, where some force depends on multipliers and `what` does not support that.
 */
kempe_status kmp_refuse_load_dependent(const kempe_system *system, const char *what);

/** KEMPE_E_ARGUMENT, with its name, where the model has friction that sticks and `what` has no modes for it. */
kempe_status kmp_refuse_friction(const kempe_model *model, const char *what);
