/* SPDX-License-Identifier: BSD-3-Clause */
/* Goals of the start: COORDINATE: number, position(BODY.POINT): [x, y, z], or either as {value: .., weight: ..}. */
#pragma once

#include "model/read/reading.h"

void kmp_read_goals(kmp_reader *r, const kmp_yaml *map); /* of the start, after the held coordinates */
