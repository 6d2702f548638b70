/* SPDX-License-Identifier: BSD-3-Clause */
#pragma once

#include "model/data/wheels.h"
#include "model/read/reading.h"

void kmp_read_wheels(kmp_reader *r);

/** Closures of rigid wheels, and the forces of all wheels. */
void kmp_add_wheel_closures(kmp_reader *r);
void kmp_add_wheel_forces(kmp_reader *r);
