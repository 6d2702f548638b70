/* SPDX-License-Identifier: BSD-3-Clause */
/* Linear equations from inputs to outputs near a state: with du the change of the independent coordinates and w that of
 * the inputs
 *
 *     Mr dudd + Gr dud + Kr du + L w = 0,     dy = Yu du + Yud dud + Yudd dudd + Yw w,
 *
 * all exact: kmp_linear_follow gives the change of the state with u and the inputs, and the outputs' own derivatives
 * give theirs. From there either x = (du, dud), xd = A x + B w, y = C x + D w, which needs the inverse of Mr. Or the
 * response to w e^(i omega t) by one complex solution, which does not. */
#pragma once

#include "analyses/derivatives/linearized.h"
#include "analyses/derivatives/parameter_slopes.h"
#include "base/arena.h"
#include "model/read/read_outputs.h"

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

/** A column of L: an input, or its `order`-th time derivative, which acts separately where the input moves a closure.
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

/** The number of loads of an input: the function of a drive, and an input that moves a closure, act with their rates,
 * all others directly. */
int kmp_transfer_orders(const kempe_model *model, const kmp_requested_input *input);

/** Makes room. `linear` has chosen its u. `place`: for each input, the index of its point's position among the outputs
 * (forces alone), or of its first derivative (parameters and inputs of the model alone). KEMPE_E_MEMORY. */
kempe_status kmp_transfer_init(kmp_transfer *transfer, kmp_linear *linear, kmp_slopes *slopes,
                               const kmp_requested_inputs *inputs, const int *place, int outputs,
                               const kmp_output_source *source);
void kmp_transfer_free(kmp_transfer *transfer);

/** Evaluates all at the state of the linear equations, which must have Mr, Gr and Kr. No allocation. */
void kmp_transfer_eval(kmp_transfer *transfer);

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

/** Replaces A and B of an averaged system (analyses/derivatives/averaged.h) by those from one common sample to the
 * next, for inputs that are held between; *period: that time. Results as kmp_sampled_map. */
int kmp_transfer_sample(const kmp_transfer *transfer, double *a, double *b, double *period);
