/* SPDX-License-Identifier: BSD-3-Clause */
/* Irregularities of a track: tables over the arc length, or generated from a spectrum. */
#pragma once

#include "model/read/reading.h"

/** The irregularities of a track. */
void kmp_read_irregularities(kmp_reader *r, const kmp_yaml *map, const char *what, kmp_track *track);
