/* SPDX-License-Identifier: BSD-3-Clause */
/* The forces in the joints of a picture, which it shows as arrows: of the joints with the largest ones, at some of its
 * instants. */
#pragma once

#include "base/json.h"
#include "output/reactions.h"
#include "report/drawing.h"
#include <kempe/equilibrium.h>
#include <kempe/inverse.h>

typedef struct kmp_joint_arrows {
    kmp_reactions made;
    const kmp_reactions *of; /* NULL: there are no forces */
    int count;               /* instants */
    double *x, *load;        /* of each: its time or number, and of->loads numbers */
    kmp_arena arena;
} kmp_joint_arrows;

void kmp_joint_arrows_free(kmp_joint_arrows *arrows);

/** Of the rows of a run; without the last one where rates may grow without bound in it (`locked`). KEMPE_E_MEMORY. */
kempe_status kmp_joint_arrows_of_run(kmp_joint_arrows *arrows, const kempe_system *system, const kmp_samples *rows,
                                     bool least_norm, bool locked);
kempe_status kmp_joint_arrows_of_inverse(kmp_joint_arrows *arrows, const kempe_inverse *inverse);
kempe_status kmp_joint_arrows_of_equilibria(kmp_joint_arrows *arrows, const kempe_equilibrium *equilibrium);

/** Puts the member `arrows` of a picture; null where no joint has a force. */
void kmp_joint_arrows_put(kmp_json *json, const kmp_joint_arrows *arrows, const kmp_drawing *drawing);
