/* SPDX-License-Identifier: BSD-3-Clause */
/* Mass properties of shapes in closed form, as numbers that follow the parameters. A shape has its radii of gyration
 * squared about its centre, times its mass; several are added by the theorem of parallel axes. */
#pragma once

#include "model/data/shape.h"

/** The sum of all shapes with a mass; expressions are in the arena. */
void kmp_shapes_mass(kmp_arena *arena, int count, const kmp_shape *shapes, kmp_mass_part *sum);
