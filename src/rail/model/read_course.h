/* SPDX-License-Identifier: BSD-3-Clause */
#pragma once

#include "model/read/reading.h"
#include "rail/model/read_tracks.h"

/** The course of a track whose rails are placed. */
void kmp_read_course(kmp_reader *r, const kmp_yaml *list, const char *what, kmp_track *track);
