/* SPDX-License-Identifier: BSD-3-Clause */
/* Tracks: two rails, and their positions. */
#pragma once

#include "model/read/reading.h"

void kmp_read_tracks(kmp_reader *r);
