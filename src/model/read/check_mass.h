/* SPDX-License-Identifier: BSD-3-Clause */
/* Massless motions that the tree shows: those of a massless body with massless descendants only, and a last motion
 * that does not move its body's mass. */
#pragma once

#include <kempe/kempe.h>

/** Massless motions that the tree shows. KEMPE_E_INPUT: each of them, at the place of its body; KEMPE_E_MEMORY. */
kempe_status kmp_check_masses(const kempe_model *model);
