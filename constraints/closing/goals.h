/* SPDX-License-Identifier: BSD-3-Clause */
/* Goals of an assembly, by Newton's method on the manifold of closed positions. */
#pragma once

#include "constraints/closing/assemble.h"

/** Measures value and distance of the position q. false: no memory. */
bool kmp_goals_measure(const kempe_system *system, const double *q, kmp_goals_verdict *verdict);

/** Moves q (n), closed at t = 0, with the coordinates in `hold` fixed: sets end, slope and steps. false: no memory. */
bool kmp_goals_seek(const kempe_system *system, const bool *hold, double *q, kmp_goals_verdict *verdict);
