/* SPDX-License-Identifier: BSD-3-Clause */
/* The equations of one request: the requested sets, in one graph.
 *
 *     M qdd + C = J' lambda      h = 0      J qd + h_t = 0      J qdd + jdqd = 0
 */
#pragma once

#include "dynamics/closure_row.h"
#include "dynamics/kinematics/link_tree.h"
#include "dynamics/variants.h"
#include "model/data/force.h"

/** The sets of equations to derive. */
enum {
    KMP_SET_MASS = 1 << 0,     /* M */
    KMP_SET_BIAS = 1 << 1,     /* C, applied forces and efforts included */
    KMP_SET_CLOSURE = 1 << 2,  /* h, J, h_t */
    KMP_SET_JDQD = 1 << 3,     /* gamma */
    KMP_SET_RESIDUAL = 1 << 4, /* of the dae formulation: R = Newton/Euler(q, qd, qdd) - J' lambda, J' mu, J qd + h_t */
    KMP_SET_ENERGY = 1 << 5,   /* potential energy and the power of non-conservative forces */
    KMP_SET_REACTION = 1 << 6, /* closure forces from lambda */
    KMP_SET_OUTPUT = 1 << 7,   /* outputs in addition to the table */
    KMP_SET_ACCELERATION = 1 << 8, /* accelerations by the O(N) scheme, and their products with closures */
    KMP_SET_INVERSE = 1 << 9,      /* inverse dynamics: efforts that give qdd, without the model's forces */
    KMP_SET_INVERSE_Q = 1 << 10,   /* derivatives of the inverse dynamics by q, and by qd; by qdd it is M */
    KMP_SET_INVERSE_QD = 1 << 11,
    KMP_SET_CLOSED = 1 << 12,   /* inverse dynamics less J' lambda */
    KMP_SET_CLOSED_Q = 1 << 13, /* derivatives of KMP_SET_CLOSED by q; by qd they are KMP_SET_INVERSE_QD */
    KMP_SET_POWER = 1 << 14,    /* the power only of non-conservative forces, in addition to other sets of dynamics */
    KMP_SET_FRICTION = 1 << 15, /* rates, levels and forces of friction that sticks */
    KMP_SET_NEXT = 1 << 16,     /* next values of states with samples or events, and whether events hold */
    KMP_SET_CONTACT = 1 << 17,  /* distances of rigid contacts, their rates and forces */
    KMP_SET_IMPACT = 1 << 18,   /* rates of all rows after an impact; with KMP_SET_CLOSURE */
    KMP_SET_POWER_SLOPES = 1 << 19, /* of the power by q and qd; shares most with derivatives by composite bodies */
    KMP_SET_DELAYED = 1 << 20,      /* signals of continuous delays, those before the start, and the delays */
    KMP_SET_CONDITIONS = 1 << 21,   /* values of the request's conditions, of which all laws have been derived */
    KMP_SET_ALONG = 1 << 22,        /* changes along a direction; with the sets that it differentiates */
    KMP_SET_LOADS = 1 << 23,        /* derivatives of C by the multipliers; with C and the closures */
    KMP_SET_START = 1 << 24,        /* start values of the coordinates and rates, as given */
    KMP_SET_KINETIC = 1 << 25,      /* the kinetic energy, link by link */
    KMP_SET_PRODUCT = 1 << 26,      /* M x, of x as accelerations */
};

typedef enum kmp_scheme { KMP_SCHEME_COMPOSITE, KMP_SCHEME_NER } kmp_scheme;

/** The sets to derive from a model, and the method. */
typedef struct kmp_derivation_request {
    unsigned sets;
    kmp_scheme scheme;
    kmp_keep keep;
    bool body_inputs;            /* forces and torques on the bodies as inputs */
    const char *no_inputs;       /* names of bodies without, with commas between; NULL: none */
    bool efforts;                /* efforts on the coordinates as inputs: of the accelerations */
    bool closed;                 /* the accelerations include the closures' multipliers */
    bool loops_alone;            /* no rows of drives */
    bool frictionless;           /* no rows of friction that sticks */
    bool keep_modes;             /* rows of modes also where they are evaluated in place, and zero */
    const kmp_force *alone;      /* the force element that acts; NULL: all */
    bool quick;                  /* of large mechanisms, variants are tried without force elements: these take longer */
    bool unloaded;               /* no force element acts */
    bool labels;                 /* nodes get names */
    bool charted;                /* spherical joints have charts as inputs (model/data/spherical.c) */
    unsigned without;            /* rules of the graph that are not applied (symbolic/graph.h) */
    uint32_t nodes;              /* that the graph will have, about; 0: unknown */
    bool returns;                /* the equations will be derived again from their closures on */
    bool plain;                  /* as derived: without search for shorter variants */
    bool optimize;               /* look longer for the choice with the fewest operations: joint by joint */
    const kmp_savings *savings;  /* NULL: the one with the fewest operations of some */
    const kmp_savings *first;    /* found for other sets of the same model: a large one's search begins there */
    kmp_savings *found;          /* becomes those found, for `first`; empty without search; to be freed */
    kmp_savings *chosen;         /* becomes those found for these sets, with the closures'; as `found` */
    unsigned then;               /* the sets to derive after the search, without variants; 0: `sets`, by the best */
    kmp_tangent_method tangents; /* without ways: the method for both derivatives of the inverse dynamics */
    kmp_events *events;          /* conditions as inputs, appended to those present; NULL: evaluated in place */
    bool given_delays;           /* the caller sets the states of continuous delays, which have no rate */
    bool modes_alone;            /* of conditions, only the modes of friction are inputs, in the order of the forces */
    bool friction_in_place;      /* the force of friction that sticks is a function of its mode and the state */
} kmp_derivation_request;

/** The closures. m rows; n coordinates. */
typedef struct kmp_closure_equations {
    kmp_row *rows;     /* m */
    int *first;        /* of a closure's declared rows (kmp_tree) */
    double *misfit;    /* by closures, scaled: the widest of its rows that no coordinate moves, taken as rounding */
    kmp_ref *h, *h_t;  /* m */
    kmp_ref *rate;     /* m: of rows of rates; all others have the rate of h */
    kmp_ref *jacobian; /* m x n, entry (r, k) at r n + k */
    kmp_ref *jdqd;     /* m */
    kmp_ref *hdot;     /* m */
    kmp_ref *derived;  /* h, hdot, jdqd (m each) and J by differentiation; NULL: no search for variants */
    kmp_ref *reaction; /* 3 a closure */
    kmp_ref *after;    /* m: J qd after an impact of the contacts that are held */
} kmp_closure_equations;

/** The dynamics without the closures' rows; of which are NULL unless requested. */
typedef struct kmp_dynamics_equations {
    kmp_ref *mass;                              /* n x n, entry (i, k) at i n + k for k <= i */
    kmp_ref *bias;                              /* n */
    kmp_ref *product;                           /* n: M x, of x as accelerations */
    kmp_ref *residual;                          /* n */
    kmp_ref *inverse;                           /* n */
    kmp_ref *closed;                            /* n */
    kmp_ref *inverse_q, *inverse_qd, *closed_q; /* n x n, row by row; NULL unless requested */
    kmp_ref *loads;                             /* dC/dlambda, n x m; NULL unless requested */
    kmp_ref *jt_mu;                             /* n */
} kmp_dynamics_equations;

typedef struct kmp_energy_equations {
    kmp_ref potential, power, kinetic;
    kmp_ref *power_q, *power_qd; /* n: derivatives of the power; NULL unless requested */
} kmp_energy_equations;

/** By articulated bodies: accelerations and multipliers; the part of each acceleration that no multiplier makes; of
 * each row its pivot, and what it would be without the rows eliminated before; the mass-orthogonal change with J x =
 * -KMP_IN_MU. Rows that are not KMP_IN_KEPT have the multiplier zero. */
typedef struct kmp_articulated_equations {
    kmp_ref *accelerations, *multipliers, *open; /* n, m, n */
    kmp_ref *pivots, *diagonals;                 /* m */
    kmp_ref *correction;                         /* n */
} kmp_articulated_equations;

typedef struct kmp_output_equations {
    kmp_ref *position; /* 3 a position output, in order */
    int position_count;
    kmp_ref *shown; /* all outputs in addition to the table, in order */
    int shown_count;
    kmp_table_uses uses; /* tables in them */
} kmp_output_equations;

/** Of each friction element that sticks, in the order of the forces: rate, sizes in slip and in stick, friction. */
typedef struct kmp_sticking_equations {
    kmp_ref *slip, *level, *holding, *force;
    int count;
} kmp_sticking_equations;

/** Of each rigid contact, in the order of the forces: distance, its rate, force. */
typedef struct kmp_contact_equations {
    kmp_ref *gap, *gap_rate, *push;
    int count;
} kmp_contact_equations;

typedef struct kmp_state_equations {
    kmp_ref *next, *when; /* of each state with a next value: it; 1 where the condition of its event holds */
    int count;            /* of these */
    kmp_ref *start;       /* n x 2: start values of q and qd, as given; 0 where none is */
} kmp_state_equations;

/** Of each continuous delay: the signal, that before the start or 0, seconds. */
typedef struct kmp_delay_equations {
    kmp_ref *signal, *before, *delay;
    int count;
} kmp_delay_equations;

typedef struct kmp_condition_equations {
    kmp_ref *changes; /* of each condition: it holds where this is negative; then the unknowns of their blocks */
    int count, watched_count; /* the conditions; with the unknowns */
} kmp_condition_equations;

/** Changes of `closed`, h, rates and accelerations of the closures, `shown` and `changes` along a direction. */
typedef struct kmp_change_equations {
    kmp_ref *change;
    int count;
} kmp_change_equations;

typedef struct kmp_equations {
    kempe_context *context;
    const kempe_model *model;
    kmp_graph *graph; /* has the room of all arrays */
    kmp_noted *noted;
    kmp_graph_mark mark; /* the graph with only the closures, for a request that returns to it */
    kmp_tree tree;       /* for closures, outputs and users */
    kmp_tree links;      /* for the dynamics, when the variants have other links */
    kmp_savings savings;
    int *run; /* n: rotations about parallel axes */
    int n, m;
    kmp_closure_equations closures;
    kmp_dynamics_equations dynamics;
    kmp_energy_equations energy;
    kmp_articulated_equations articulated;
    kmp_output_equations outputs;
    kmp_sticking_equations sticking;
    kmp_contact_equations contacts;
    kmp_state_equations states;
    kmp_delay_equations delays;
    kmp_condition_equations conditions;
    kmp_change_equations along;
} kmp_equations;

/** True for a value that depends on accelerations or multipliers. */
bool kmp_is_late(const kmp_graph *g, kmp_ref value);

/** Conditions in two groups, in each followed by the unknowns of its implicit blocks, with which counts grow; outputs
 * of the second depend on accelerations or multipliers. NULL: no memory. */
kmp_ref *kmp_conditions_with_solved(kmp_graph *g, const kmp_ref *conditions, int counts[2]);

/** Derives the equations by the request's variants. Without variants all axes turn with their links, and closures use
 * the shortest variants. Errors as kmp_equations_derive. */
kempe_status kmp_equations_derive_once(kmp_equations *eq, const kempe_model *model,
                                       const kmp_derivation_request *request);
/** Exchanges the closures' rows for closures.derived, and back. */
void kmp_equations_swap_derived(kmp_equations *eq);
/** Derives M, C, inverse dynamics and accelerations of a request that returns again, by other variants. The closures
 * are unchanged, and the earlier dynamics are gone. */
kempe_status kmp_equations_derive_again(kmp_equations *eq, const kmp_derivation_request *request);
/** Derives the equations of a request with these members, all others zero. Errors as kmp_equations_derive. */
kempe_status kmp_equations_init(kmp_equations *eq, const kempe_model *model, unsigned sets, kmp_scheme scheme,
                                bool keep_parameters);
void kmp_equations_free(kmp_equations *eq);

/** Entries of KMP_IN_ALONG, one after the other: t and the numbers of given inputs as in KMP_IN_TIME, the parameters,
 * q, qd, qdd and lambda: the place where each begins, and their number. */
typedef struct kmp_directions {
    int parameters, q, qd, qdd, lambda, count;
} kmp_directions;
kmp_directions kmp_equations_directions(const kempe_model *model, int rows);

/** J qdd + jdqd of a row. */
kmp_ref kmp_equations_curve(const kmp_equations *eq, int row);

/** Runs the passes over outputs of these equations (symbolic/shorten.h). False: no memory. */
bool kmp_equations_shorten(const kmp_equations *eq, int count, kmp_ref *outputs);
