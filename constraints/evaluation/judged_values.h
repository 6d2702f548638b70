/* SPDX-License-Identifier: BSD-3-Clause */
/* Energies, power, reactions and outputs of an evaluator at a state. */
#pragma once

#include <stdbool.h>

struct kmp_evaluator;

/** True if M waits and energies are found link by link: all but energies then needs articulated bodies. */
bool kmp_eval_goes_by_links(const struct kmp_evaluator *eval);

/** Kinetic energy qd' M qd / 2 of the last kmp_eval_mass; both energies at its place. */
double kmp_eval_kinetic(struct kmp_evaluator *eval, const double *qd);
void kmp_eval_energies(struct kmp_evaluator *eval, const double *qd, double *kinetic, double *potential);

/** Potential energy at (t, q); power of the non-conservative forces at (t, q, qd); closure forces (3 per closure) at
 * (t, q, lambda). */
double kmp_eval_potential(struct kmp_evaluator *eval, double t, const double *q);
double kmp_eval_power(struct kmp_evaluator *eval, double t, const double *q, const double *qd);
/** Power of the non-conservative forces from the last kmp_eval_bias, whose rates are qd. */
double kmp_eval_power_here(struct kmp_evaluator *eval, const double *qd);
const double *kmp_eval_reactions(struct kmp_evaluator *eval, double t, const double *q, const double *lambda);

/** Values of the model's outputs in addition to the table, in their order (model/data/output_table.h). */
const double *kmp_eval_shown(struct kmp_evaluator *eval, double t, const double *q, const double *qd, const double *qdd,
                             const double *lambda);
