/* SPDX-License-Identifier: BSD-3-Clause */
/* What the model's outputs show beside the table of every run, as expressions. */
#ifndef KMP_DYNAMICS_OUTPUTS_H
#define KMP_DYNAMICS_OUTPUTS_H

#include "dynamics/equations.h"
#include "dynamics/forces.h"

/** True when some output needs the values of force elements or an energy. */
bool kmp_outputs_need_forces(const kempe_model *model);

/** Fills eq->position and eq->shown, with what those outputs need that are asked for and no more. `forces` may be NULL
 *  when none needs it. false: no memory. */
bool kmp_outputs_derive(kmp_equations *eq, const kmp_forces *forces);

#endif
