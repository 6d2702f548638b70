/* SPDX-License-Identifier: BSD-3-Clause */
/* DOPRI5: Dormand and Prince's pair of orders 5 and 4 with dense output of order 4 (explicit_methods.h). Cheaper
 * than DOP853 at rtol of 1e-5 and above. */
#pragma once

#include "integrators/steppers/rk.h"

extern const kmp_rk_method kmp_dopri5; /* order 5, dense output of order 4 */
