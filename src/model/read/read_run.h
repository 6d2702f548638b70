/* SPDX-License-Identifier: BSD-3-Clause */
/* Start values and settings of runs. */
#pragma once

#include "model/read/reading.h"

void kmp_read_start(kmp_reader *r);
void kmp_read_run(kmp_reader *r);
