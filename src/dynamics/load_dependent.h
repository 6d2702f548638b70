/* SPDX-License-Identifier: BSD-3-Clause */
/* Forces that depend on multipliers, delays and contacts, by name where a study does not support them. */
#pragma once

#include "dynamics/system.h"
#include "model/data/force.h"

/** KEMPE_E_ARGUMENT, with a state's name, where the model has delays of continuous signals, which `what` does not
 * follow; the remedy. */
kempe_status kmp_refuse_delays(const kempe_model *model, const char *what, const char *remedy);
#define KMP_INSTEAD_OF_DELAY "replace the delay by a transfer function (Pade) or by samples"

/** True if an expression, or the law of a force, has a multiplier of a closure. */
bool kmp_depends_on_closure(const kmp_expr *e, int closure);
bool kmp_force_depends_on_closure(const kmp_force *force, int closure);

/** The name of a force that depends on multipliers of a row's closure. */
const char *kmp_load_dependent_force(const kempe_system *system, int row);

/** KEMPE_E_ARGUMENT, with its name, where the model has rigid contacts and `what` does not open and close them. */
kempe_status kmp_refuse_contacts(const kempe_model *model, const char *what);
