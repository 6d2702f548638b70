/* SPDX-License-Identifier: BSD-3-Clause */
/* The start of flexible bodies in balance with their loads. */
#pragma once

#include "constraints/closing/assemble.h"

/** With `elastic: static`, moves the deformations that hold at a closed start until their equations of motion are
 * satisfied without accelerations: independent joints stay where they are, dependent ones follow. Rates of independent
 * coordinates stay. KEMPE_E_FAILED, with the reason: there is no such deformation nearby, or it is not found. */
kempe_status kmp_static_start(const kempe_system *system, kempe_assembly *assembly);
