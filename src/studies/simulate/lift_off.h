/* SPDX-License-Identifier: BSD-3-Clause */
/* Ideal followers on cams that pull. */
#pragma once

#include "dynamics/system.h"
#include "output/samples.h"

/** Warns of each ideal follower whose cam pulls it in some row: it would lift off. */
void kmp_warn_of_lift_off(const kempe_system *system, const kmp_samples *table);
