/* SPDX-License-Identifier: BSD-3-Clause */
/* Outputs of wheels on rails: their contacts, their guidance, their pose. */
#pragma once

#include "dynamics/outputs.h"

extern const kmp_output_of_wing kmp_wheel_outputs[];
