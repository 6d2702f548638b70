/* SPDX-License-Identifier: BSD-3-Clause */
/* Force elements: the rows of force_kinds.def. */
#pragma once

#include "model/read/reading.h"

void kmp_read_forces(kmp_reader *r);
