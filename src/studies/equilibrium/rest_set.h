/* SPDX-License-Identifier: BSD-3-Clause */
/* States of rest that dry friction holds: around a state at rest, an interval of one coordinate for each independent
 * element that sticks. On it that element moves, with those that share its freedom, while the other elements stay where
 * they are and all other motions stay in balance. */
#pragma once

#include "derivatives/linearized.h"
#include "integrators/friction/friction_state.h"

typedef enum kmp_rest_word {
    KMP_REST_SLIPS, /* friction is used up there */
    KMP_REST_LIMIT, /* the motions do not continue beyond it, or have no balance */
    KMP_REST_BEYOND /* still held there: the search ends */
} kmp_rest_word;

typedef struct kmp_rest_end {
    double *q; /* n: the last state that is held */
    kmp_rest_word word;
} kmp_rest_end;

typedef struct kmp_rest_set {
    const kmp_force *element;
    int coordinate; /* whose interval it is */
    kmp_rest_end end[2];
} kmp_rest_set;

/** The word of an end for people and for tables. */
const char *kmp_rest_text(kmp_rest_word word);

/** Finds the sets around q (n, at rest and held by friction), at t. `sets`: of `arena`, one for each independent
 * element. Changes the state of `linear` and its friction. Errors: KEMPE_E_MEMORY, KEMPE_E_FAILED. */
kempe_status kmp_rest_sets_find(kmp_linear *linear, kmp_friction_state *friction, double t, const double *q,
                                kmp_arena *arena, int *count, kmp_rest_set **sets);
