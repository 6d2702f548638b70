/* SPDX-License-Identifier: BSD-3-Clause */
/* A tyre on its road: its force, and the outputs of its contact. */
#pragma once

#include "dynamics/forces/law.h"
#include "dynamics/outputs.h"

extern const kmp_law_row kmp_tyre_laws[];

extern const kmp_output_of_wing kmp_tyre_outputs[];

/** The contact point and the axes of a contact, in ground axes. */
void kmp_tyre_place(const kmp_tree *tree, const kmp_force *force, kmp_vec *place, kmp_vec axes[3]);
