/* SPDX-License-Identifier: BSD-3-Clause */
/* The model's outputs in addition to the table of every run, as expressions. */
#pragma once

#include "dynamics/equations.h"
#include "dynamics/forces/forces.h"
#include "model/data/output.h"

/** True when some output needs the values of force elements or an energy. */
bool kmp_outputs_need_forces(const kempe_model *model);

/** Fills eq->position and eq->shown, with the quantities that requested outputs need and no more. `forces` may be NULL
 * when none needs it. KEMPE_E_MEMORY; KEMPE_E_INPUT where the load of a joint is not known. */
kempe_status kmp_outputs_derive(kmp_equations *eq, const kmp_forces *forces);

/** The values of a kind of output that a wing has, appended to the equations' `shown`; `show` NULL ends a list. */
typedef struct kmp_output_of_wing {
    kmp_output_kind kind;
    void (*show)(kmp_equations *equations, const kmp_output *output);
} kmp_output_of_wing;
