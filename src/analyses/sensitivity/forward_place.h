/* SPDX-License-Identifier: BSD-3-Clause */
/* The place of a motion with sensitivities (forward.h): a state with the derivatives of all coordinates, kept while the
 * unknowns change their meaning, between two formulations, two choices of u or two charts of a spherical joint. */
#pragma once

#include "base/arena.h"
#include "dynamics/system.h"

struct kmp_forward_formulation;

typedef struct kmp_forward_place {
    double t;               /* NAN: nothing is kept, and the arrays are room */
    double *chart, *q, *qd; /* of all spherical joints; n */
    double *dq, *dqd;       /* columns x n */
    double *tail;           /* integrals: the last of the unknowns, and their derivatives */
} kmp_forward_place;

/** Make room, of columns once or again: integrals are then kept without derivatives. False: no memory. */
bool kmp_forward_place_make(kmp_forward_place *place, kmp_arena *arena, const kempe_system *system);
bool kmp_forward_place_widen(kmp_forward_place *place, kmp_arena *arena, int n, int columns);

/** Puts the whole mechanism at (t, y), except integrals, into the place. */
int kmp_forward_spread(struct kmp_forward_formulation *f, double t, const double *y);

/** y, except integrals, from the place. */
void kmp_forward_pack(struct kmp_forward_formulation *f, double *y);

/** Converts the place to the evaluator's charts, in which it is (q, qd). */
void kmp_forward_enter_charts(struct kmp_forward_formulation *f, const double *q, const double *qd);

/** True if the evaluator's charts are not the charts of the place. */
bool kmp_forward_charts_differ(const struct kmp_forward_formulation *f);
