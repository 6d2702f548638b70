/* SPDX-License-Identifier: BSD-3-Clause */
/* The projected formulation: y = (q, qd[, work]); accelerations from the saddle system, by the solved program
 * (constraints/programs/saddle_program.h) where there is one and its pivots are good. */
#pragma once

#include "integrators/formulations/formulation.h"

/** The formulation across change points: only a runner enters and leaves it. */
extern const kmp_formulation_kind kmp_formulation_near_singular;
