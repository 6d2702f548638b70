/* SPDX-License-Identifier: BSD-3-Clause */
/* Friction and contacts at a state at rest: rows that are held, and the forces that they need. */
#pragma once

#include "integrators/run/friction_state.h"

/** Holds the rows of all elements with a level, or of the elements in `which` (count), at (t, q), as far as they are
 * independent, whether or not friction can. `place` (count; NULL: as at q): where. The words of the views follow. */
kempe_status kmp_friction_state_lock(kmp_friction_state *state, double t, const double *q, const bool *which,
                                     const double *place);

/** Places and rates of all elements at (t, q, qd; NULL: zero). */
void kmp_friction_state_look(kmp_friction_state *state, double t, const double *q, const double *qd);

/** At a state at rest: the least part of the static levels with which friction keeps all elements at rest, INFINITY if
 * none does, and such forces. No row is held afterwards. */
kempe_status kmp_friction_state_load(kmp_friction_state *state, double t, const double *q);

typedef enum kmp_normal_load {
    KMP_PRESSED_NOT,
    KMP_PRESSED,           /* closed by its row, if that is independent; otherwise by the rows of others */
    KMP_PRESSED_IF_IMPLIED /* closed where the rows of the others keep it so */
} kmp_normal_load;

/** Closes contacts at (t, q) as `pressed` (count) says. Friction keeps its modes. The words of the contacts follow. */
kempe_status kmp_friction_state_press(kmp_friction_state *state, double t, const double *q,
                                      const kmp_normal_load *pressed);

/** Distances of contacts, and places of friction, at (t, q); no mode changes. */
void kmp_friction_state_measure(kmp_friction_state *state, double t, const double *q, double *place);

/** True if no contact overlaps at (t, q), and none pulls with the forces of the last kmp_friction_state_load. `place`
 * (count) is changed. */
bool kmp_friction_state_agrees(kmp_friction_state *state, double t, const double *q, double *place);
