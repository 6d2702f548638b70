/* SPDX-License-Identifier: BSD-3-Clause */
#include "model/data/gear.h"

const char *const kmp_gear_number_keys[KMP_GEAR_NUMBERS] = {"radius", "radius",     "module",
                                                            "helix",  "lead_angle", "pressure_angle"};
