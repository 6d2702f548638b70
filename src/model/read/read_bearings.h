/* SPDX-License-Identifier: BSD-3-Clause */
/* The section `bearings`. */
#pragma once

#include "model/read/reading.h"

void kmp_read_bearings(kmp_reader *r);
