/* SPDX-License-Identifier: BSD-3-Clause */
/* What wheels on rails add to the core (base/wings.h). */
#pragma once

#include "constraints/kinds/kind.h"
#include "dynamics/forces/law.h"
#include "dynamics/outputs.h"

extern const kmp_closure_of_wing kmp_wheel_closures[]; /* wheel_closure.c */
extern const kmp_law_row kmp_wheel_laws[];             /* wheel_force.c */
extern const kmp_output_of_wing kmp_wheel_outputs[];   /* wheel_outputs.c */
