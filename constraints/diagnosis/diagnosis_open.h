/* SPDX-License-Identifier: BSD-3-Clause */
/* Reasons of a failed assembly. Held coordinates are released in trials, one by one and then all. */
#pragma once

#include "constraints/diagnosis/diagnosis.h"

/** Finds the reason why an assembly stays open. */
kempe_status kmp_obstacle_find(kmp_obstacle *obstacle, const kempe_assembly *assembly, kmp_arena *arena);
