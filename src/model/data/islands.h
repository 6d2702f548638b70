/* SPDX-License-Identifier: BSD-3-Clause */
/* Parts of a model that share nothing but bodies that do not move: no joint, closure, force or expression connects
 * them, so that the motion of one does not depend on the motion of another. Each is a separate model. */
#pragma once

#include "base/arena.h"
#include <kempe/kempe.h>

/** A part of a model. Its elements are in the order of the whole. Outputs, shapes and goals are left out. */
typedef struct kmp_island {
    kempe_model *model;
    int *motion, *closure; /* by its own coordinates and closures: their numbers in the whole */
} kmp_island;

typedef struct kmp_islands {
    kmp_arena arena; /* of all models and lists */
    int count;       /* 0: the model is one */
    kmp_island *island;
} kmp_islands;

/** Finds the parts of a finished model, which must outlive them. Each part with rigid contacts or friction that sticks
 * is apart; all others together are one part. All have the inputs. A model with states, delays, wheels, flexible
 * bodies, compliant contacts, implicit variables or conditions that end the run counts as one, as does one without such
 * contacts and friction. `left_out`: the rigid contacts, by forces, that are in no part, nor is their friction; NULL:
 * none. With such contacts one part is enough, and only a model that other elements connect counts as one. */
kempe_status kmp_islands_new(const kempe_model *model, const bool *left_out, kmp_islands **islands);
void kmp_islands_free(kmp_islands *islands);
