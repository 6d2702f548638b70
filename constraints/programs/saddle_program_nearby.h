/* SPDX-License-Identifier: BSD-3-Clause */
/* Accelerations and multipliers near the place of known factors: one residual, one solution, no factors. The
 * residual is that of Newton and Euler's equations with J' lambda, shorter than M qdd + C - J' lambda. */
#pragma once

#include "constraints/evaluation/evaluator.h"
#include "constraints/partition/partition.h"

/** kmp_saddle_program_write_nearby for a run of so many operations. False: no memory. */
bool kmp_saddle_program_write_near(const kmp_evaluator *eval, const kmp_partition *part, double run,
                                   kmp_program **program);
