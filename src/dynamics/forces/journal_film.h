/* SPDX-License-Identifier: BSD-3-Clause */
/* Forces of the film of a journal. */
#pragma once

#include "dynamics/kinematics/pressing.h"

/** Rates, and the forces against them: on the journal's centre along the bearing's axes, and the torque of shear. */
typedef struct kmp_film_load {
    kmp_ref against[3], size[3];
} kmp_film_load;

void kmp_film_find(const kmp_tree *tree, const kmp_force *force, const kmp_pressing *at, kmp_film_load *load);
