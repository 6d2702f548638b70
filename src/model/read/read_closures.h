/* SPDX-License-Identifier: BSD-3-Clause */
/* Loop closures and drives. */
#pragma once

#include "model/read/reading.h"

void kmp_read_closures(kmp_reader *r); /* drives too */
