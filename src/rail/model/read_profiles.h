/* SPDX-License-Identifier: BSD-3-Clause */
/* Profiles: cross-sections of wheels and rails, by points. */
#pragma once

#include "model/data/wheels.h"
#include "model/read/reading.h"

void kmp_read_profiles(kmp_reader *r);

/** A profile of the model by its name; NULL after an error. */
const kmp_profile *kmp_read_profile(kmp_reader *r, const kmp_yaml *node, const char *what);
