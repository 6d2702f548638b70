/* SPDX-License-Identifier: BSD-3-Clause */
/* Energies, power, reactions and outputs at a state. */
#pragma once

#include "constraints/evaluation/evaluator.h"

/** Potential energy at (t, q); power of the non-conservative forces at (t, q, qd); closure forces (3 per closure) at
 * (t, q, lambda). */
double kmp_eval_potential(kmp_evaluator *eval, double t, const double *q);
double kmp_eval_power(kmp_evaluator *eval, double t, const double *q, const double *qd);
/** Power of the non-conservative forces from the last kmp_eval_bias, whose rates are qd. */
double kmp_eval_power_here(kmp_evaluator *eval, const double *qd);
const double *kmp_eval_reactions(kmp_evaluator *eval, double t, const double *q, const double *lambda);

/** Values of the model's outputs in addition to the table, in their order (model/data/output_table.h). */
const double *kmp_eval_shown(kmp_evaluator *eval, double t, const double *q, const double *qd, const double *qdd,
                             const double *lambda);
