/* SPDX-License-Identifier: BSD-3-Clause */
/* Tangents for a few places, which pay for no derivation of programs. */
#pragma once

#include "constraints/evaluation/tangent.h"

/** Prepares R, rate and curve for a few places: only derivatives, by dual numbers if possible. */
kempe_status kmp_tangents_init_few(kmp_tangents *tangents, const kempe_system *system, const kmp_backend *backend);

/** True if C or J depends on the time or on an input of the model, or if this is not known: for certain functions, and
 * without memory. After an evaluator of the system has been made. */
bool kmp_equations_move_in_time(const kempe_system *system);

/** Takes new values of the system's parameters. */
void kmp_tangents_renew_parameters(kmp_tangents *tangents, const double *parameters);
