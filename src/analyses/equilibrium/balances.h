/* SPDX-License-Identifier: BSD-3-Clause */
/* The equilibria that were found, each with all its results. */
#pragma once

#include "analyses/derivatives/averaged.h"
#include "analyses/derivatives/linearized.h"
#include "analyses/equilibrium/exchange.h"
#include "constraints/closing/assemble.h"
#include "constraints/diagnosis/shared_loads.h"
#include "integrators/run/friction_state.h"
#include "model/data/force.h"
#include "output/samples.h"
#include <kempe/equilibrium.h>

/* Stability of small motions about an equilibrium: the eigenvalues of Mr s^2 + Gr s + Kr, zeros separated. The result
 * is of first order and for the given model: a constant rate holds only if the model enforces it. */
typedef enum kmp_stability_word {
    KMP_STABLE,  /* all small motions decay */
    KMP_NEUTRAL, /* nothing grows; some motions remain displaced, or continue */
    KMP_UNSTABLE,
    KMP_NOT_HELD, /* friction sticks there by more than it can have: the state is not an equilibrium */
    KMP_UNDECIDED /* the reduced mass is not positive, or singular by forces of multipliers; a root of delays is almost
                     on the axis; sides of a condition disagree */
} kmp_stability_word;

typedef struct kmp_stability {
    kmp_stability_word word;
    int growing;        /* eigenvalues with a positive real part */
    bool secular;       /* motions grow as a power of time (analyses/derivatives/spectrum.h) */
    double re, im;      /* the eigenvalue whose real part is largest, zeros left out; NaN: there is none */
    int still;          /* directions in which R does not change */
    int *along;         /* the coordinates that move most in each */
    const char *change; /* NULL, or a condition: a force of one of its sides pushes away, or the sides do not decide */
} kmp_stability;

/** At the last state, its matrices made. `along`: room for p. KEMPE_E_MEMORY. */
kempe_status kmp_stability_judge(const kmp_linear *linear, kmp_stability *stability);

/** "stable", "neutral", "unstable", "not held", "undecided". */
const char *kmp_stability_text(kmp_stability_word word);

enum { KMP_MOST_BALANCES = 64 };

typedef enum kmp_contact_word {
    KMP_CONTACT_OPEN,
    KMP_CONTACT_PRESSES,
    KMP_CONTACT_TOUCHES, /* without a force */
    KMP_CONTACT_SHARES   /* closed by the rows of others: its force is one of several that are possible */
} kmp_contact_word;

/** The word of a contact for people and for tables. */
const char *kmp_contact_text(kmp_contact_word word);

typedef struct kmp_balance_contact {
    const kmp_force *element;
    double gap, force, size;
    bool closed, shares;
    kmp_contact_word word;
} kmp_balance_contact;

/* States of rest that dry friction holds: around a state at rest, an interval of one coordinate for each independent
 * element that sticks. On it that element moves, with the elements that share its freedom, while the other elements
 * stay where they are and all other motions stay in balance. */
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

typedef struct kmp_balance {
    double *q, *qd;          /* n, as the user counts them */
    double *lambda;          /* m */
    double *reaction;        /* KMP_LOAD_VALUES a closure, then a joint of the tree that has a load */
    kmp_shared_loads shared; /* components that redundant constraints share; named only where there are closures */
    const char *not_unique;  /* their names; "": none */
    double *shown;           /* values of the model's outputs; NULL: it requests none */
    double *freed;           /* values solved for */
    double residual, potential;
    kmp_stability stability;
    int *idle; /* coordinates that nothing depends on: they stayed where they were */
    int idle_count;
    int iterations, exchanges;
    double *residuals, *steps; /* iterations */
    int hits;                  /* starts that ended here */
    int friction_count;        /* elements that stick, where requested */
    kmp_friction_view *friction;
    double friction_part; /* of their static levels that they need */
    int contact_count;    /* rigid contacts */
    kmp_balance_contact *contact;
    double work; /* the largest of a force along a coordinate, J of its size */
    int set_count;
    kmp_rest_set *set; /* states of rest that friction holds */
} kmp_balance;

struct kempe_equilibrium {
    kmp_averaged *averaged;                 /* of a model with sampled states; NULL: it has none */
    const kempe_system *given;              /* the caller's */
    const kempe_system *requested, *system; /* the caller's, or the averaged one; the one used in the computation */
    kmp_exchange *exchange;                 /* NULL: none */
    kmp_friction_state *friction;           /* during the search; NULL: no friction sticks */
    bool stick;                             /* friction keeps its places of the start */
    kmp_steady *rates;
    int rate_count;
    int freed_count;                       /* solved for: parameters, and rates as "qd(NAME)" */
    const char **freed_name, **freed_unit; /* unit "" of a parameter */
    bool state_alone;                      /* states and multipliers are wanted, without what is said of them */
    const kempe_assembly *start;           /* where a motion begins, closed; NULL: the start is assembled */
    const char *resting;                   /* then, friction at rest without a force, by name; NULL: none */
    double *inner_q, *inner_qd, *chart;    /* then, of the first balance in its charts */
    bool newton, all, many;                /* many: ended before its time, more than KMP_MOST_BALANCES */
    bool from_start;                       /* the first was reached from the start */
    int starts, closed, found, ended;      /* ended: a run would end there, so that they are none */
    kmp_all_loads loads;                   /* derived at the first balance */
    bool has_loads, least_norm;            /* of loads that are shared */
    kmp_balance balance[KMP_MOST_BALANCES];
    int count;
    kmp_arena arena;
    kempe_status status;
    char *warnings; /* of the computation, one per line */
};

/** kempe_equilibrium_new only for the states: no loads, no stability, no coordinates without effect. */
kempe_status kmp_equilibrium_states_new(const kempe_system *system, bool newton, kempe_equilibrium **equilibrium);

/** Likewise with stability, from a closed start that the caller has; `rates` as of kempe_equilibrium_options. */
kempe_status kmp_equilibrium_from(const kempe_system *system, const char *rates, const kempe_assembly *start,
                                  kempe_equilibrium **equilibrium);

/** True if nothing depends on the coordinate, which moves. */
bool kmp_balance_is_cyclic(const kmp_balance *balance, int coordinate);

/** Appends the coordinates that move steadily, and how (kmp_steady_list). *kept: rates are as at the start; *held: a
 * load that is not in the model keeps one. Returns their number; -1: no memory. */
int kmp_balance_put_cyclic(kmp_text *text, const kempe_equilibrium *equilibrium, const kmp_balance *balance, bool *kept,
                           bool *held);

/** Appends what grows, after the word of the stability; nothing where nothing does. */
void kmp_balance_put_growth(kmp_text *text, const kmp_stability *stability);

/** Adds the forces of closures, and of joints of the tree at rest or at constant rates, by these multipliers. */
kempe_status kmp_balance_add_loads(kempe_equilibrium *equilibrium, const kmp_linear *linear, const double *lambda,
                                   kmp_balance *balance);

/** Adds the model's outputs at the state of `linear`, by the multipliers of the balance. */
kempe_status kmp_balance_add_outputs(kempe_equilibrium *equilibrium, const kmp_linear *linear, kmp_balance *balance);
