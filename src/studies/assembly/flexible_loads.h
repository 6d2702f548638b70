/* SPDX-License-Identifier: BSD-3-Clause */
/* Loads of flexible bodies at the start: the ratio to the loads that buckle them, and loads in directions without
 * shapes. */
#pragma once

#include "constraints/diagnosis/diagnosis.h"

typedef enum kmp_unshaped {
    KMP_UNSHAPED_TORSION,
    KMP_UNSHAPED_Z,
    KMP_UNSHAPED_Y,
    KMP_UNSHAPED_DIRECTIONS
} kmp_unshaped;

/** A joint of the tree, a closure, or a force at a point, a constant or one of time, that loads a flexible body in
 * directions in which it has no shape. */
typedef struct kmp_unshaped_load {
    int flexible;
    const char *kind, *name; /* "joint", "loop" or "force" */
    bool in[KMP_UNSHAPED_DIRECTIONS];
} kmp_unshaped_load;

typedef struct kmp_flexible_loads {
    double *taken;       /* of each flexible body, as of kmp_load_margin_at */
    bool springs, creep; /* as of kmp_load_margin_has_springs, kmp_load_margin_has_creep */
    int count;
    kmp_unshaped_load *list;
    kmp_arena arena;
} kmp_flexible_loads;

/** Without a message: what cannot be computed is left out. False: no memory; it must be freed also then. */
bool kmp_flexible_loads_find(kmp_flexible_loads *loads, const kempe_check *check);
void kmp_flexible_loads_free(kmp_flexible_loads *loads);
