/* SPDX-License-Identifier: BSD-3-Clause */
/* The loads of all joints and loops of a mechanism at an instant, from its accelerations and multipliers. */
#pragma once

#include "integrators/formulations/evaluation_point.h"

enum { KMP_LOAD_VALUES = 6 }; /* a force, and a moment about the point of the second body, in ground axes */

typedef struct kmp_all_loads {
    int joints, *joint; /* bodies whose joints have a load of their own, in the order of the model */
    kmp_formulas formulas;
    kmp_arena arena;
} kmp_all_loads;

/** Derives them. Joints of the tree have none where one of them is not known. KEMPE_E_MEMORY. */
kempe_status kmp_all_loads_init(kmp_all_loads *loads, const kempe_system *system);
void kmp_all_loads_free(kmp_all_loads *loads);

/** KMP_LOAD_VALUES of each closure, then of each of `joint`; qd and qdd count where there are joints. */
const double *kmp_all_loads_at(kmp_all_loads *loads, const kmp_instant *at);
