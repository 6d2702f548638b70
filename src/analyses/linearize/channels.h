/* SPDX-License-Identifier: BSD-3-Clause */
/* A mechanism near a state with named inputs and outputs: the basis of state spaces and frequency responses. */
#pragma once

#include "analyses/derivatives/averaged.h"
#include "analyses/equilibrium/operating.h"
#include "analyses/linearize/transfer.h"
#include "model/data/variant.h"

/** NULL: the default of each. */
typedef struct kmp_channels_options {
    const char *at, *inputs, *outputs, *independent, *backend;

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

/** Derives, takes the state and evaluates. Default outputs: those of the model where there are inputs, otherwise none.
 * KEMPE_E_ARGUMENT, KEMPE_E_FAILED with the reason. */
kempe_status kmp_channels_init(kmp_channels *channels, const kempe_system *system, const kmp_channels_options *options);
void kmp_channels_free(kmp_channels *channels);
