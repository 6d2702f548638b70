/* SPDX-License-Identifier: BSD-3-Clause */
/* The forces that a picture shows as arrows, the largest ones at some of its instants: in joints and between the teeth
 * of gears, at contacts, tyres and the ends of ropes. */
#pragma once

#include "base/json.h"
#include "output/reactions.h"
#include "picture/drawing.h"
#include <kempe/equilibrium.h>
#include <kempe/inverse.h>

typedef struct kmp_picture_forces {
    kmp_reactions made;
    const kmp_reactions *of; /* NULL: there are no forces */
    int count;               /* instants */
    double *x, *load;        /* of each: its time or number, and of->loads numbers */
    int placed_count;        /* forces with a place that moves */
    struct kmp_placed_force *placed;
    double
        *acting; /* KMP_PLACED_VALUES of each at each instant: the place from the origin of its body, and the force */
    kmp_arena arena;
} kmp_picture_forces;

void kmp_picture_forces_free(kmp_picture_forces *arrows);

/** Of the rows of a run; without the last one where rates may grow without bound in it (`locked`). KEMPE_E_MEMORY. */
kempe_status kmp_picture_forces_of_run(kmp_picture_forces *arrows, const kempe_system *system, const kmp_samples *rows,
                                       bool least_norm, bool locked);
kempe_status kmp_picture_forces_of_inverse(kmp_picture_forces *arrows, const kempe_inverse *inverse);
kempe_status kmp_picture_forces_of_equilibria(kmp_picture_forces *arrows, const kempe_equilibrium *equilibrium);

/** Puts the member `arrows` of a picture; null where there is no force. */
void kmp_picture_forces_put(kmp_json *json, const kmp_picture_forces *arrows, const kmp_drawing *drawing);
