/* SPDX-License-Identifier: BSD-3-Clause */
/* A wheel on its rail. An elastic wheel has a normal force and a creep force in each zone; a rigid one has the creep
 * force alone, which depends on the multiplier of the wheel's closure. */
#pragma once

#include "dynamics/forces/law.h"

extern const kmp_law_row kmp_wheel_laws[];
