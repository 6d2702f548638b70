/* SPDX-License-Identifier: BSD-3-Clause */
/* A rigid wheel on a rigid rail: h is the gap along the normal at the closest points; lambda is the normal force. */
#pragma once

#include "constraints/kinds/kind.h"

extern const kmp_closure_of_wing kmp_wheel_closures[];
