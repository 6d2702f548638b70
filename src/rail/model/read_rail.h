/* SPDX-License-Identifier: BSD-3-Clause */
/* Readers of profiles, tracks and wheels. */
#pragma once

#include "model/read/reading.h"

void kmp_read_profiles(kmp_reader *r);
void kmp_read_tracks(kmp_reader *r);
void kmp_read_wheels(kmp_reader *r);

/** Closures of rigid wheels, and the forces of all wheels. */
void kmp_add_wheel_closures(kmp_reader *r);
void kmp_add_wheel_forces(kmp_reader *r);

/** A profile of the model by its name; NULL after an error. */
const kmp_profile *kmp_read_profile(kmp_reader *r, const kmp_yaml *node, const char *what);

/** The irregularities of a track. */
void kmp_read_irregularities(kmp_reader *r, const kmp_yaml *map, const char *what, kmp_track *track);

/** The course of a track whose rails are placed. */
void kmp_read_course(kmp_reader *r, const kmp_yaml *list, const char *what, kmp_track *track);
