/* SPDX-License-Identifier: BSD-3-Clause */
/* Tangents for a few places, which pay for no derivation of programs. */
#pragma once

#include "constraints/evaluation/tangent.h"

/** Prepares R, rate and curve for a few places: derivatives alone, by dual numbers if possible. */
kempe_status kmp_tangents_init_few(kmp_tangents *tangents, const kempe_system *system, const kmp_backend *backend);

/** Takes new values of the system's parameters. */
void kmp_tangents_renew_parameters(kmp_tangents *tangents, const double *parameters);
