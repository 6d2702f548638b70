/* SPDX-License-Identifier: BSD-3-Clause */
/* Parameters: any may refer to any other. Each is valued as soon as its operands are; those left when nothing more
 * can be valued form a cycle. */
#pragma once

#include "model/read/reading.h"

void kmp_read_parameters(kmp_reader *r);
