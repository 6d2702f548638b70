/* SPDX-License-Identifier: BSD-3-Clause */
/* Friction that sticks, and rigid contacts, at a state without a run: for equilibria and small motions. The inputs of
 * their elements belong to an evaluator of the caller; they stay as they are set until they are set again
 * (kmp_evaluator.holds_friction). Contacts are closed by kmp_friction_state_decide, or by callers, and
 * stay so for all other functions, also functions of another object with the same evaluator. */
#pragma once

#include "constraints/evaluation/evaluator.h"

typedef enum kmp_friction_word {
    KMP_FRICTION_WORD_SLIPS,
    KMP_FRICTION_WORD_STICKS,
    KMP_FRICTION_WORD_SHARES, /* it sticks, with others on one freedom: its force is one of several that are possible */
    KMP_FRICTION_WORD_OPEN    /* other closures keep its place: its force is not determined */
} kmp_friction_word;

/* Of a contact: `slips` is open, `sticks` is closed by its row, `shares` closed by the rows of others; its place is the
 * distance, and it has no largest force. */
typedef struct kmp_friction_view {
    const struct kmp_force *element;
    bool contact;
    bool off;   /* friction of an open contact */
    bool limit; /* a contact that touches without a force, after kmp_friction_state_decide */
    kmp_friction_word word;
    double place, rate, force, largest; /* its force; the static level */
    double needs;                       /* size of the force, of both components where slip has two directions */
    double size;                        /* of its place */
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

/** Decides on modes at (t, q, qd) as a run that starts there does; elements that stick and contacts that press hold
 * their rows, others slip or are open. Without a level an element is free. KEMPE_E_FAILED with a message, also where
 * surfaces overlap or strike. */
kempe_status kmp_friction_state_decide(kmp_friction_state *state, double t, const double *q, const double *qd);

typedef enum kmp_held_contact {
    KMP_HELD_NOT,
    KMP_HELD_BY_ROW,
    KMP_HELD_BY_OTHERS /* the rows of others imply its own */
} kmp_held_contact;

/** The mode in which the evaluator closes the contact of a view; its friction is not closed. */
kmp_held_contact kmp_friction_state_closed(const kmp_friction_state *state, int i);

/** Evaluates all conditions at (t, q, qd; NULL: zero), with friction free and contacts as they are; then the places and
 * rates of the views there. For callers that hold elements themselves. */
void kmp_friction_state_evaluate(kmp_friction_state *state, double t, const double *q, const double *qd);
void kmp_friction_state_take_places(kmp_friction_state *state);

/** After kmp_friction_state_decide: friction that sticks has no row and no force; contacts stay closed. */
void kmp_friction_state_slide(kmp_friction_state *state);

/** Gives up all rows and forces of friction: elements follow the sign of their rates, and have no force at rest. */
void kmp_friction_state_release(kmp_evaluator *eval);

/** Opens all contacts. */
void kmp_friction_state_open(kmp_evaluator *eval);

/** Closes contacts as in the evaluator of another object; `from` (count): the number of each element there. */
void kmp_friction_state_take_contacts(kmp_friction_state *state, const kmp_friction_state *other, const int *from);
