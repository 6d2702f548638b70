/* SPDX-License-Identifier: BSD-3-Clause */
/* A mechanism near a state with named inputs and outputs: the basis of state spaces and frequency responses. */
#pragma once

#include "analyses/derivatives/averaged.h"
#include "analyses/derivatives/linearized.h"
#include "analyses/derivatives/parameter_slopes.h"
#include "analyses/equilibrium/operating.h"
#include "analyses/linearize/requested_inputs.h"
#include "base/arena.h"
#include "model/data/force.h"
#include "model/data/variant.h"

/** The source of an output's value: number `index` of q, qd, qdd, lambda, or of the additional outputs. */
typedef enum kmp_output_kind_of_source {
    KMP_SOURCE_Q,
    KMP_SOURCE_QD,
    KMP_SOURCE_QDD,
    KMP_SOURCE_LAMBDA,
    KMP_SOURCE_SHOWN
} kmp_output_kind_of_source;

typedef struct kmp_output_source {
    kmp_output_kind_of_source in;
    int index;
} kmp_output_source;

/** A column of L: an input, or its `order`-th time derivative, which acts separately where the equations read it.
 */
typedef struct kmp_load {
    int input, order;
    int parameter; /* of the parameter derivatives, also of an input of the model; -1: it is none */
    int place;     /* of a force: first of the three shown values that are its point's position */
} kmp_load;

typedef struct kmp_transfer {
    kmp_arena arena;    /* of all arrays */
    kmp_linear *linear; /* not owned, at the state */
    kmp_slopes *slopes; /* not owned */
    int n, m, p;
    const kmp_requested_inputs *inputs;
    int outputs, columns;
    kmp_output_source *source;     /* outputs */
    kmp_load *load;                /* columns */
    double *map, *map_rate;        /* n x p: dq = N du, dqd = N dud + Nd du */
    double *loads;                 /* p x columns: L */
    double *by_u, *by_ud, *by_udd; /* outputs x p */
    double *direct;                /* outputs x columns: Yw */
    double *value;                 /* outputs: y at the state */
    double *side, *moved, *shown;  /* work: of a change of the equations, of a kmp_response, of additional outputs */
    double *unit;                  /* p: zeros */
} kmp_transfer;

void kmp_transfer_free(kmp_transfer *transfer);

/** True if a parameter among the inputs moves closures: its rate then acts, too, for which there is no column. */
bool kmp_transfer_moves_closures(const kmp_transfer *transfer, int input);

/** The states x of a state space: du and dud without the integrals of states of the model, and without states that are
 * constant. Number k of x among the 2p.
 */
int kmp_transfer_width(const kmp_transfer *transfer);
int kmp_transfer_state(const kmp_transfer *transfer, int k);

/** A (w x w, w the width, in room for 2p x 2p), B (w x columns), C (outputs x w) and D (outputs x columns),
 * column-major. 0; 1 + k: the reduced mass
 *  is not positive for u[k]; -1: no memory; -2: Mr is singular. */
int kmp_transfer_first_order(const kmp_transfer *transfer, double *a, double *b, double *c, double *d);

/** Replaces A and B of an averaged system (analyses/derivatives/averaged.h) by the matrices from one common sample to
 * the next, for inputs that are held between; *period: that time. Results as kmp_sampled_map. */
int kmp_transfer_sample(const kmp_transfer *transfer, double *a, double *b, double *period);

/** NULL: the default of each. */
typedef struct kmp_channels_options {
    const char *at, *inputs, *outputs, *independent, *backend;
    bool slides; /* friction that sticks has no force */
} kmp_channels_options;

typedef struct kmp_names {
    int count;
    char **name, **unit;
} kmp_names;

typedef struct kmp_channels {
    kmp_arena arena;                    /* of names and scratch */
    kmp_averaged *averaged;             /* of a model with sampled states; NULL: it has none */
    const kempe_system *given, *system; /* the caller's, or the averaged one, and the one that is evaluated */
    kmp_variant *variant;               /* NULL: both systems are equal */
    kempe_system *own;
    kmp_operating *at;
    kmp_linear linear;
    kmp_slopes *slopes;
    kmp_requested_inputs inputs;
    kmp_transfer transfer;
    kmp_names states, loads, outputs; /* x, w, y; a load is an input or a time derivative of it */
    bool rests;                       /* no acceleration, and motion changes no force */
    bool goes_on;                     /* rests, but for rates that change no force */
    double residual;                  /* of the state at rest, relative: its distance from equilibrium */
    double build_s;                   /* CPU time of derivation */
    kempe_status status;
    char *warnings; /* of the computation, one per line */
} kmp_channels;

/** Derives, takes the state and evaluates. Default outputs: the outputs of the model where there are inputs, otherwise
 * none. KEMPE_E_ARGUMENT, KEMPE_E_FAILED with the reason. */
kempe_status kmp_channels_init(kmp_channels *channels, const kempe_system *system, const kmp_channels_options *options);
void kmp_channels_free(kmp_channels *channels);
