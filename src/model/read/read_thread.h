/* SPDX-License-Identifier: BSD-3-Clause */
/* Friction in the thread of a screw joint. */
#pragma once

#include "model/read/reading.h"

/** True for friction with `mu` on the rotation of a screw joint, whose thread rubs unless it names another reaction. */
bool kmp_is_thread(const kempe_model *model, const kmp_force *force, const kmp_yaml *map);

/** Reads mu, mu_static, radius and flank into the levels of the friction. */
void kmp_read_thread(kmp_reader *r, const kmp_yaml *map, const char *what, kmp_force *force);
