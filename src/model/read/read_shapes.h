/* SPDX-License-Identifier: BSD-3-Clause */
/* Shapes of bodies and of the ground. */
#pragma once

#include "model/read/reading.h"

/** Appends the shapes that are without error to those of the model. */
void kmp_read_shapes(kmp_reader *r, const kmp_yaml *map, const kmp_shape_owner *owner);
