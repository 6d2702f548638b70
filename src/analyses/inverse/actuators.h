/* SPDX-License-Identifier: BSD-3-Clause */
/* The coordinates whose forces inverse dynamics finds, from the options of the study. */
#pragma once

#include "base/arena.h"
#include "dynamics/system.h"
#include <kempe/inverse.h>

typedef struct kmp_actuators {
    int count;
    int *coordinate;
    double *weight; /* positive; of the least norm where there are too many */
    bool weighted;  /* the user has given some */
} kmp_actuators;

/** Reads actuators and weights; without any, the coordinates of the model's drives. KEMPE_E_ARGUMENT, KEMPE_E_MEMORY;
 * the arrays are of the arena. */
kempe_status kmp_actuators_read(kmp_actuators *actuators, kmp_arena *arena, const kempe_system *system,
                                const kempe_inverse_options *options);

/** True if a closure is a drive or a lock of the user. */
bool kmp_is_drive_of_user(const kempe_model *model, int closure);
