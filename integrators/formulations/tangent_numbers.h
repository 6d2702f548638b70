/* SPDX-License-Identifier: BSD-3-Clause */
/* Tangents of the equations of motion, by numbers. */
#pragma once

#include "integrators/formulations/tangent.h"

/** True if available: no implicit block, no user-defined force, a moderate number of coordinates. */
bool kmp_tangent_numbers_can(const kempe_system *system);

/** Makes the tangents in the arena, and adds all entries to the list with positions in the outputs as sources. NULL:
 * no memory. */
kmp_tangent_numbers *kmp_tangent_numbers_new(const kempe_system *system, kmp_listing *list, kmp_arena *arena);

void kmp_tangent_numbers_set_parameters(kmp_tangent_numbers *numbers, const double *parameters);

/** Evaluates all entries; valid until the next call; no allocation. */
const double *kmp_tangent_numbers_eval(kmp_tangent_numbers *numbers, const kmp_instant *at);
