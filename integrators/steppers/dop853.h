/* SPDX-License-Identifier: BSD-3-Clause */
/* DOP853: order 8, combined error estimate of orders 5 and 3, dense output of order 7 (explicit_methods.h). */
#pragma once

#include "integrators/steppers/rk.h"

extern const kmp_rk_method kmp_dop853; /* order 8, dense output of order 7 */
