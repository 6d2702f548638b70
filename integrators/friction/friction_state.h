/* SPDX-License-Identifier: BSD-3-Clause */
/* Friction that sticks at a state, without a run: for equilibria and small motions. The inputs of its elements are
 * those of an evaluator of the caller; they stay as they are set until they are set again
 * (kmp_evaluator.holds_friction). */
#pragma once

#include "constraints/evaluation/evaluator.h"

typedef enum kmp_friction_word {
    KMP_FRICTION_WORD_SLIPS,
    KMP_FRICTION_WORD_STICKS,
    KMP_FRICTION_WORD_SHARES, /* it sticks, with others on one freedom: its force is one of several that are possible */
    KMP_FRICTION_WORD_OPEN    /* other closures keep its place: its force is not determined */
} kmp_friction_word;

typedef struct kmp_friction_view {
    const kmp_force *element;
    kmp_friction_word word;
    double place, rate, force, largest; /* its force; the static level */
} kmp_friction_view;

typedef struct kmp_friction_state {
    int count;
    kmp_friction_view *view;
    double part;             /* of kmp_friction_state_load */
    const double *lambda;    /* m: multipliers with the forces of kmp_friction_state_load */
    struct kmp_runner *site; /* what the decisions of runs need */
} kmp_friction_state;

/** The elements of an evaluator's system; *none: it has no such friction, and nothing is made. KEMPE_E_MEMORY. */
kempe_status kmp_friction_state_new(kmp_evaluator *eval, kmp_friction_state **state, bool *none);
void kmp_friction_state_free(kmp_friction_state *state);

/** Decides on modes at (t, q, qd) as a run that starts there does; elements that stick hold their rows, others slip.
 * Without a level an element is free. KEMPE_E_FAILED with a message. */
kempe_status kmp_friction_state_decide(kmp_friction_state *state, double t, const double *q, const double *qd);

/** Holds the rows of all elements with a level, or of those in `which` (count), at (t, q), as far as they are
 * independent, whether or not friction can. `place` (count; NULL: as at q): where. The words of the views follow. */
kempe_status kmp_friction_state_lock(kmp_friction_state *state, double t, const double *q, const bool *which,
                                     const double *place);

/** Places and rates of all elements at (t, q, qd; NULL: zero). */
void kmp_friction_state_look(kmp_friction_state *state, double t, const double *q, const double *qd);

/** At a state at rest: the least part of the static levels with which friction keeps all elements at rest, INFINITY if
 * none does, and such forces. No row is held afterwards. */
kempe_status kmp_friction_state_load(kmp_friction_state *state, double t, const double *q);

/** Gives up all rows and forces: elements follow the sign of their rates, and have no force at rest. */
void kmp_friction_state_release(kmp_evaluator *eval);
