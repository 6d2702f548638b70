/* SPDX-License-Identifier: BSD-3-Clause */
/* Forces that depend on the multipliers of closures, and forces and closures that depend on time. */
#pragma once

#include "model/data/closure.h"
#include "model/data/force.h"
#include "model/data/output.h"
#include "model/language/expression.h"
#include <kempe/kempe.h>
#include <stdbool.h>

/** The number of these elements, whose rows are the last closures. */
int kmp_model_friction_count(const kempe_model *model);

/** True if the model has rigid contacts. */
bool kmp_model_has_contacts(const kempe_model *model);

/** True if friction is pressed by the size of a reaction (`mu`). */
bool kmp_model_presses_friction(const kempe_model *model);

/** The first multiplier in the expressions of a force, NULL when there is none. */
const kmp_expr *kmp_force_lambda(const kmp_force *force);

/** True if the force depends on multipliers: by its law, or as friction of a contact, whose level does. */
bool kmp_force_has_load(const kmp_force *force);

/** True if a force or a sensor may depend on multipliers of the closures. */
bool kmp_model_has_loads(const kempe_model *model);

/** The first closure that depends on an input, NULL when there is none. */
const kmp_closure *kmp_model_moved_by(const kempe_model *model, int input);

/** The vector KMP_IN_TIME at t: t, then the value of each input and two derivatives (1 + 3 input_count). */
void kmp_model_times(const kempe_model *model, double t, double *vector);

/** True if an output shows multipliers, or quantities that depend on them. */
bool kmp_output_has_loads(const kempe_model *model, const kmp_output *output);

/** kmp_context_begin for a computation with a model, whose notes become its warnings. */
void kmp_model_begin(const kempe_model *model);
/** The same of a computation to which forces matter: laws that mean less than they seem to say are warnings. */
void kmp_model_begin_forces(const kempe_model *model);
