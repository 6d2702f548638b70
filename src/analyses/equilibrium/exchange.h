/* SPDX-License-Identifier: BSD-3-Clause */
/* Inverse equilibrium: coordinates with fixed values, prescribed output values, and as many parameters or rates that
 * become unknown instead. The equations belong to a variant whose released parameters are variable. Their
 * derivatives are exact (analyses/derivatives/parameter_slopes.h). */
#pragma once

#include "analyses/derivatives/linearized.h"
#include "analyses/derivatives/parameter_slopes.h"
#include "analyses/equilibrium/equilibrium_study.h"
#include "analyses/equilibrium/friction_at_rest.h"
#include "integrators/run/friction_state.h"
#include "model/data/force.h"
#include "model/data/variant.h"

/** One additional equation. */
typedef struct kmp_exchange_target {
    int coordinate; /* -1: an output */
    int shown;      /* its index among the values of outputs */
    double value;
    const char *name;
} kmp_exchange_target;

typedef struct kmp_exchange {
    kmp_variant *variant;
    kempe_system *system; /* of the variant */
    kmp_slopes *slopes;
    int free_count; /* parameters first, then rates */
    int parameter_count;
    const char **name; /* free_count: in the order of the request */
    double *value;     /* free_count */
    int *rate;         /* free_count - parameter_count: which of the steady coordinates */
    kmp_exchange_target *target;
    int target_count;
    double *trial, *given; /* free_count: trial values; values in the model and for the caller */
    kmp_text why;          /* reason of the last rejected values, empty when they were accepted */
    kmp_arena arena;
} kmp_exchange;

/** An exchange from the user's words (kempe/equilibrium.h), NULL where there are none; `rates`: of the coordinates that
 * move steadily. KEMPE_E_ARGUMENT: the invalid word, and the valid ones. Other errors as kmp_variant_new and
 * kempe_system_new. */
kempe_status kmp_exchange_new(const kempe_system *system, const char *fix, const char *require, const char *release,
                              const kmp_steady *rates, int rate_count, kmp_exchange **exchange);
void kmp_exchange_free(kmp_exchange *exchange);

/** Back to the values that were given. */
void kmp_exchange_begin(kmp_exchange *exchange, kmp_linear *linear, kmp_steady *rates);

/** Gives all that is free these values (free_count): the system, `linear` and the rates follow. false: the model cannot
 *  have them. */
bool kmp_exchange_set(kmp_exchange *exchange, const double *values, kmp_linear *linear, kmp_steady *rates);

/* Rigid contacts in a search for an equilibrium: which of them press. A contact that is closed is a row of J, at the
 * distance zero, and its multiplier may not be negative in the end; the distance of an open one may not be negative. A
 * descent ends each step at the first surface that it meets, whose contact is closed from there on. At an equilibrium
 * the contact that pulls most is opened, and the search continues: an active-set method (Nocedal and Wright 2006,
 * section 16.5). Friction of contacts takes no part here: it has no force at rest unless its place is kept by a row. */

typedef struct kmp_contact_set {
    kempe_context *context;
    kmp_friction_state *state;
    int count;               /* elements of `state` */
    kmp_normal_load *closed; /* count; only contacts */
    double *gap;             /* count, at the last state that was looked at */
    int struck;              /* the contact that ended the last step; -1: none */
    int passes;              /* equilibria whose contacts did not agree */
} kmp_contact_set;

/** The contacts of a model at (t, q): closed are the contacts that touch or overlap there, or are closed in the
 * evaluator already. NULL: there are no contacts, or `keeps`: contacts in the evaluator stay. KEMPE_E_MEMORY. */
kempe_status kmp_contact_set_begin(kmp_linear *linear, double t, const double *q, bool keeps, kmp_arena *arena,
                                   kmp_contact_set **set);
void kmp_contact_set_end(kmp_contact_set *set);

/** The contacts that touch or overlap at (t, q) are in the set, all others are not; nothing is closed yet. */
void kmp_contact_set_touch(kmp_contact_set *set, double t, const double *q);

/** Closes the contacts of the set at (t, q), opens all others. Coordinates are to be chosen again. */
kempe_status kmp_contact_set_press(kmp_contact_set *set, double t, const double *q);

/** Distances of all contacts at (t, q). */
void kmp_contact_set_look(kmp_contact_set *set, double t, const double *q);

/** At the last state that was looked at: the open contact that overlaps most, in sizes; -1: none. */
int kmp_contact_set_overlap(const kmp_contact_set *set);

/** Changes the set by one contact at an equilibrium, the last state of `linear`: closes the one that overlaps most, or
 * opens the one that pulls most. `work`: of all forces along the coordinates, J. *agrees: there is none; contacts
 * that the closed ones imply are then closed, too. KEMPE_E_FAILED, with the names: no set agrees. */
kempe_status kmp_contact_set_exchange(kmp_contact_set *set, const kmp_linear *linear, double work, bool *agrees);

/** KEMPE_E_FAILED with its name where the contact that was struck is closed already by the rows of others, which it
 * leaves. */
kempe_status kmp_contact_set_check(const kmp_contact_set *set);
