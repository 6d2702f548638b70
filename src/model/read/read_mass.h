/* SPDX-License-Identifier: BSD-3-Clause */
/* Mass, centre of mass and inertia, and the check that a body can have them. */
#pragma once

#include "model/read/reading.h"
#include <kempe/kempe.h>

/** Warns of bodies that a coordinate turns about an axis whose moment of inertia is left out. */
void kmp_note_moments(kmp_reader *r);

/** Warns of moments of inertia and centres of mass without units that are too large for the points of the model, as
 * numbers in kg mm^2 and mm are. */
void kmp_warn_of_sizes(kmp_reader *r);

void kmp_read_mass(kmp_reader *r, const kmp_yaml *map, int body); /* and shapes */

/** Massless motions that the tree shows. KEMPE_E_INPUT: each of them, at the place of its body; KEMPE_E_MEMORY. */
kempe_status kmp_check_masses(const kempe_model *model);

/** Appends the shapes that are without error to the shapes of the model. */
void kmp_read_shapes(kmp_reader *r, const kmp_yaml *map, const kmp_shape_owner *owner);
