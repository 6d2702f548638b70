/* SPDX-License-Identifier: BSD-3-Clause */
/* Mass, centre of mass and inertia, and the check that a body can have them. */
#pragma once

#include "model/read/reading.h"

/** Warns of bodies that a coordinate turns about an axis whose moment of inertia is left out. */
void kmp_note_moments(kmp_reader *r);

void kmp_read_mass(kmp_reader *r, const kmp_yaml *map, int body); /* and shapes */
