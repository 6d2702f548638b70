/* SPDX-License-Identifier: BSD-3-Clause */
/* A wheel on its rail: its forces, its closure where it is rigid, and the outputs of its contacts, its guidance and its
 * pose. */
#pragma once

#include "constraints/kinds/kind.h"
#include "dynamics/forces/law.h"
#include "dynamics/outputs.h"
#include "rail/wheel/laws.h"
#include "rail/wheel/patch.h"

extern const kmp_law_row kmp_wheel_laws[];

extern const kmp_closure_of_wing kmp_wheel_closures[];

extern const kmp_output_of_wing kmp_wheel_outputs[];
